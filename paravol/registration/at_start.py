"""Registration at the start of a session: touch the fiducials, or take a file."""

from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from devices import Pose, Registration, register
from devices.controls.pedals import PressCollector
from devices.microscribe.wire.link import ArmDescription
from devices.registration.fiducial_fit import (
    RegistrationError,
    RegistrationReason,
)
from devices.registration.held_point import HeldPoint, HoldError
from devices.registration.pivot import shifted_to_tip
from devices.registration.registration_file import RegistrationRecord, load_registration
from paravol.inputs.pose_sources import OrderedPoses
from paravol.patient import Progress
from scenarios import Scenario

TRACKER = "OpenIGTLink"
"""In a file of a tracker, in the place of an arm's model; the serial number is the
name of its tool."""

MARK_PEDAL = 1

FEWEST_POSES = 3
"""Of a touch, without those of pressing and releasing; a slow line brings few."""

PATIENCE_S = 30.0
"""A person may take this long from one fiducial to the next."""


def register_by_touch(
    source: OrderedPoses,
    fiducials: dict[str, NDArray[np.float64]],
    progress: Progress,
) -> Registration:
    """Wait until every fiducial has been touched, in order, and fit.

    Raises TimeoutError when nothing is touched for `PATIENCE_S`, RegistrationError
    when the touched points do not fit.
    """
    press = PressCollector(MARK_PEDAL)
    touched: list[NDArray[np.float64]] = []
    wanted = len(fiducials)
    quiet_since: float | None = None
    progress("Touching the fiducials", 0.0)
    while len(touched) < wanted:
        pose = source.read(PATIENCE_S)
        if quiet_since is None:
            quiet_since = pose.time_s
        if (held := press.feed(pose)) is not None:
            # A tip that moved, or hardly rested, is to be held there again.
            with suppress(HoldError):
                touched.append(HeldPoint.of(held, FEWEST_POSES).tip_mm)
                progress("Touching the fiducials", len(touched) / wanted)
                quiet_since = pose.time_s
        if pose.time_s - quiet_since > PATIENCE_S:
            name = list(fiducials)[len(touched)]
            raise TimeoutError(
                f"Nobody touched the fiducial {name!r} for {PATIENCE_S:g} seconds; "
                "hold the stylus on it and press the right pedal."
            )
    return register(
        np.stack(touched),
        np.stack(list(fiducials.values())),
        list(fiducials),
    )


@dataclass(frozen=True, slots=True)
class TippedPoses:
    """Pass an arm's poses on, moved to the tip that was calibrated.

    tip_mm: ``(3,)`` in the frame of the tip that the arm states.
    """

    source: OrderedPoses
    tip_mm: NDArray[np.float64]

    def read(self, timeout_s: float) -> Pose:
        """Return the next pose; raise as the source does."""
        return shifted_to_tip(self.source.read(timeout_s), self.tip_mm)


def head_of(scenario: Scenario) -> str:
    """Return the name of the head that a registration belongs to."""
    return f"{scenario.name}, seed {scenario.head.seed}"


def tracker_record(
    file: Path, tool: str | None, scenario: Scenario
) -> RegistrationRecord:
    """Read the registration of a tracker, made by `paravol register --input`.

    tool: the tool that is asked for, None for the one in the file. Raise
    RegistrationError when the file holds none, or one of another tool or another head.
    """
    record = load_registration(file)
    if record.arm_model != TRACKER:
        _refuse_other(file, "device", TRACKER, record.arm_model, " --input")
    _refuse_other(file, "head", head_of(scenario), record.head, " --input")
    if tool is not None:
        _refuse_other(file, "tool", tool, record.arm_serial, " --input")
    return record


def registered_by_file(
    source: OrderedPoses, file: Path, arm: ArmDescription, scenario: Scenario
) -> tuple[TippedPoses, Registration]:
    """Take a registration made by `paravol register`; give the poses of its tip.

    A MicroScribe has to be registered anew whenever it was switched on: its base may
    have been turned meanwhile, which no file can know. Raises RegistrationError when
    the file holds none, or one of another arm or another head.
    """
    record = load_registration(file)
    _refuse_other(file, "arm", arm.identity.serial, record.arm_serial)
    _refuse_other(file, "head", head_of(scenario), record.head)
    return TippedPoses(source, np.array(record.tip_mm)), record.registration()


def _refuse_other(
    file: Path, what: str, wanted: str, found: str, option: str = ""
) -> None:
    if wanted != found:
        raise RegistrationError(
            RegistrationReason.FILE,
            f"{file} registers the {what} {found!r}, this is {wanted!r}; make a new "
            f"one with `paravol register{option}`.",
        )
