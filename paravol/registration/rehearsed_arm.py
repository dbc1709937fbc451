"""An arm that registers itself: emulated, in this process, with a hand's errors.

Its metal differs from its parameter block as a real arm's does and it wears a longer
tip than it states, so that what a registration reaches with it can be measured.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices import ProbePath
from devices.microscribe import MicroScribe
from devices.microscribe.emulator.emulated_arm import EmulatedArm
from devices.microscribe.emulator.in_memory import DrivenClock, MemoryLine
from devices.microscribe.emulator.placement import place_arm
from devices.microscribe.emulator.script import RehearsedArm
from devices.microscribe.kinematics.error_model import KinematicErrorModel
from devices.microscribe.kinematics.jacobian import PARAMETER_NAMES
from devices.microscribe.kinematics.profiles import DX40937, ArmProfile
from devices.microscribe.kinematics.uncertainty import ParameterSpread
from devices.port import HostClock
from devices.registration.registration_file import RegistrationRecord

LONGER_TIP_MM = 14.0
"""By which the emulated tip is longer than the stated one."""

CHANCES = 20
STRIDE = 1000
"""Seeds of further tries, away from those that a person would give."""

TILTS_DEG = (-20.0, 0.0, 20.0)
"""Of the tool at a target, from side to side and up and down."""


@dataclass(frozen=True, slots=True, eq=False)
class RehearsedTruth:
    """What nobody knows of a real arm."""

    profile: ArmProfile
    built: KinematicErrorModel
    device_from_world: NDArray[np.float64]
    held_angles: NDArray[np.float64]
    """(6,) radians at the begin of the path: elbow and wrist stay on that side."""

    def errors_mm(
        self, record: RegistrationRecord, targets: dict[str, NDArray[np.float64]]
    ) -> dict[str, float]:
        """Bring the true tip to each target; return by how far it is shown elsewhere.

        rms over nine directions of the tool, each rounded to counts.
        """
        return {name: self._error_mm(record, place) for name, place in targets.items()}

    def _error_mm(
        self, record: RegistrationRecord, place: NDArray[np.float64]
    ) -> float:
        world_from_device = np.array(record.world_from_device).reshape(4, 4)
        encoders = self.profile.encoders
        angles = self.held_angles
        turn, shift = self.device_from_world[:3, :3], self.device_from_world[:3, 3]
        off = []
        for pointing in _directions():
            angles = self.built.angles(turn @ place + shift, turn @ pointing, angles)
            read = encoders.angles(encoders.counts(angles))
            stated = self.profile.geometry.device_from_tip(read)
            tip = stated @ np.array([*record.tip_mm, 1.0])
            off.append((world_from_device @ tip)[:3] - place)
        return float(np.sqrt(np.mean(np.sum(np.square(off), axis=1))))


def rehearsed_truth(
    path: ProbePath, spread: ParameterSpread, seed: int
) -> RehearsedTruth:
    """Build the arm and put it beside the patient; the seed decides where."""
    profile = DX40937
    deviation = spread.draw(np.random.default_rng(seed))
    # d 5 is negative: more of it is a longer stylus.
    deviation[PARAMETER_NAMES.index("d 5")] -= LONGER_TIP_MM
    built = KinematicErrorModel.deviating(profile.geometry, deviation)
    place = _place(profile, path, seed)
    home = profile.encoders.angles(np.array(profile.home_counts))
    tip = place[:3, :3] @ path.tip_mm[0] + place[:3, 3]
    held = built.angles(tip, place[:3, :3] @ path.axis[0], home)
    return RehearsedTruth(profile, built, place, held)


def _place(profile: ArmProfile, path: ProbePath, seed: int) -> NDArray[np.float64]:
    """Find a place from which even the swung stylus is within reach."""
    for chance in range(CHANCES - 1):
        try:
            return place_arm(profile, path, np.zeros((0, 3)), seed + chance * STRIDE)
        except ValueError:
            continue
    return place_arm(profile, path, np.zeros((0, 3)), seed + CHANCES * STRIDE)


@contextmanager
def rehearsed_arm(truth: RehearsedTruth, path: ProbePath) -> Iterator[MicroScribe]:
    """Open the emulated arm, which follows the path from its first packet on."""
    line = rehearsed_line(truth, path, HostClock())
    with MicroScribe(line.open_port()) as arm:
        yield arm


def rehearsed_line(
    truth: RehearsedTruth, path: ProbePath, clock: HostClock | DrivenClock
) -> MemoryLine:
    """Put the emulated arm at the end of a line that lives by ``clock``."""
    motion = RehearsedArm(truth.profile, truth.built, path, truth.device_from_world)
    return MemoryLine(EmulatedArm(truth.profile, motion, now_s=clock.now()), clock)


def _directions() -> list[NDArray[np.float64]]:
    """Return unit pointing directions of a tool in the nose, patient LPS."""
    found = []
    for side in np.radians(TILTS_DEG):
        for up in np.radians(TILTS_DEG):
            way = np.array([np.tan(side), 1.0, np.tan(up)])
            found.append(way / np.linalg.norm(way))
    return found
