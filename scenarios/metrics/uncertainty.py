"""How much of a metric is the device's noise.

Low-passed poses are disturbed by what the device is known to be wrong by, and the
metrics are computed again; the standard deviation over a few draws of a fixed seed is
told. A tool held still, disturbed alike, gives each metric's noise floor.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from scenarios.metrics.measured import Contacts, HazardGaps, Measured
from scenarios.metrics.track import Track, third_column
from system import UserError

Doubles = NDArray[np.float64]

SEED = 20150112
_MOST_POSES, LEAST_DRAWS, _MOST_DRAWS = 300_000, 3, 32
"""Poses that are disturbed in all bound the draws: the time is that of a few runs."""

_THIRD = math.sqrt(20.0)
"""Standard deviation of a third difference of white noise of 1: 1 + 9 + 9 + 1."""

_MEDIAN = 0.6744897501960817
"""Median of the absolute value of a standard normal."""


@dataclass(frozen=True, slots=True)
class PoseNoise:
    """How far recorded poses are wrong, 1 sigma.

    tip_mm: ``(3, 3)`` covariance of the tip in the patient's frame, mm^2, anew in each
    sample. turn_rad: of the orientation about each axis. offset_mm: of the whole
    session against the patient, each axis: the registration. source: where it is from.
    """

    tip_mm: Doubles
    turn_rad: float
    offset_mm: float
    source: str

    def __post_init__(self) -> None:
        if self.tip_mm.shape != (3, 3) or not np.all(np.isfinite(self.tip_mm)):
            raise UserError("the covariance of a tip is 3 x 3 finite numbers")
        if not (0.0 <= self.turn_rad < 1.0 and 0.0 <= self.offset_mm < 1e3):
            raise UserError(
                f"noise must not be negative, got {self.turn_rad} rad and "
                f"{self.offset_mm} mm"
            )

    @classmethod
    def even(
        cls, tip_mm: float, turn_rad: float, offset_mm: float, source: str
    ) -> "PoseNoise":
        """Return noise that is alike along all axes."""
        return cls(tip_mm**2 * np.eye(3), turn_rad, offset_mm, source)

    @property
    def axis_mm(self) -> float:
        """Return the rms over the axes of the tip's standard deviation."""
        return math.sqrt(float(np.trace(self.tip_mm)) / 3.0)

    @property
    def factor(self) -> Doubles:
        """Return ``(3, 3)`` that makes the tip's noise of three standard normals."""
        values, vectors = np.linalg.eigh(self.tip_mm)
        root: Doubles = vectors * np.sqrt(np.maximum(values, 0.0))
        return root


@dataclass(frozen=True, slots=True)
class SessionNoise:
    """The noise of both hands, which different devices measure."""

    scope: PoseNoise
    tool: PoseNoise


def recorded_noise(track: Track, gap_s: float) -> tuple[float, float]:
    """Estimate the white noise of a record: of the tip's axes, mm, and turns, rad.

    From third differences, which leave of a hand's motion next to nothing at 100 Hz;
    by their median, so that jerks do not count. A device that rounds shows no noise
    while it is still.
    """
    tips, turns = [], []
    for places in track.spans(gap_s):
        if len(places) < 4:
            continue
        tips.append(np.diff(track.tip_mm[places], 3, axis=0).ravel())
        back = third_column(track.quaternion[places])
        turns.append(np.linalg.norm(np.diff(back, 3, axis=0), axis=1))
    if not tips:
        return 0.0, 0.0
    tip = float(np.median(np.abs(np.concatenate(tips)))) / _MEDIAN / _THIRD
    # two axes turn the shaft: the length is Rayleigh distributed
    rayleigh = math.sqrt(2.0 * math.log(2.0))
    turn = float(np.median(np.concatenate(turns))) / rayleigh / _THIRD
    return tip, turn


def draw_count(measured: Measured) -> int:
    """Return how many draws a session of this length gets."""
    poses = max(len(measured.scope.time_s) + len(measured.tool.time_s), 1)
    return int(np.clip(_MOST_POSES // poses, LEAST_DRAWS, _MOST_DRAWS))


def disturbed(
    measured: Measured, noise: SessionNoise, rng: np.random.Generator
) -> Measured:
    """Return a session as another draw of the noise would have recorded it.

    Each part has numbers of its own: it is disturbed alike whatever the others hold.
    """
    scope, tool, patient, contacts, hazards, tool_hazards = rng.spawn(6)
    offset = noise.scope.offset_mm * patient.standard_normal(3)
    return replace(
        measured,
        scope=_shaken(measured.scope, noise.scope, scope),
        tool=_shaken(measured.tool, noise.tool, tool),
        # the whole session is shifted against the patient, or he against it
        targets={name: at - offset for name, at in measured.targets.items()},
        contacts=_contacts(measured.contacts, noise.scope, contacts),
        hazards=_gaps(measured.hazards, noise.scope, hazards),
        tool_hazards=_gaps(measured.tool_hazards, noise.tool, tool_hazards),
    )


def still(
    measured: Measured, noise: SessionNoise, rng: np.random.Generator
) -> Measured:
    """Return a session of the same samples in which both tools rest and shake."""
    scope, tool = rng.spawn(2)
    return replace(
        measured,
        scope=_shaken(_resting(measured.scope), noise.scope, scope),
        tool=_shaken(_resting(measured.tool), noise.tool, tool),
    )


def spreads(values: Mapping[str, list[float]], draws: int) -> dict[str, float]:
    """Return the standard deviations of what the draws gave, by name.

    A metric that some draw had no value for has none.
    """
    return {
        name: float(np.std(found, ddof=1))
        for name, found in values.items()
        if len(found) == draws and draws > 1
    }


def _shaken(track: Track, noise: PoseNoise, rng: np.random.Generator) -> Track:
    count = len(track.time_s)
    if count == 0:
        return track
    # by einsum: of so many rows a matrix product would wake threads for nothing
    shake = np.einsum("ij,nj->ni", noise.factor, rng.standard_normal((count, 3)))
    tip = track.tip_mm + shake
    quaternion = track.quaternion
    if noise.turn_rad > 0.0:
        known = np.isfinite(quaternion).all(axis=1)
        turn = noise.turn_rad * rng.standard_normal((count, 3))
        quaternion = quaternion.copy()
        if known.any():
            turned = Rotation.from_rotvec(turn[known]) * Rotation.from_quat(
                quaternion[known]
            )
            quaternion[known] = turned.as_quat()
    return replace(track, tip_mm=tip, quaternion=quaternion)


def _resting(track: Track) -> Track:
    valid = track.valid
    if len(valid) == 0:
        return track
    known = np.isfinite(track.quaternion).all(axis=1, keepdims=True)
    first = valid[0]
    return replace(
        track,
        tip_mm=np.where(np.isfinite(track.tip_mm), track.tip_mm[first], np.nan),
        quaternion=np.where(known, track.quaternion[first], np.nan),
    )


def _moved(
    gap_mm: Doubles, shift_mm: float, noise: PoseNoise, rng: np.random.Generator
) -> Doubles:
    # a distance changes by the noise along its own gradient, which has length 1
    moved: Doubles = gap_mm + shift_mm
    return moved + noise.axis_mm * rng.standard_normal(len(gap_mm))


def _contacts(
    contacts: Contacts | None, noise: PoseNoise, rng: np.random.Generator
) -> Contacts | None:
    if contacts is None:
        return None
    shift = noise.offset_mm * float(rng.standard_normal())
    return replace(contacts, gap_mm=_moved(contacts.gap_mm, shift, noise, rng))


def _gaps(
    gaps: HazardGaps | None, noise: PoseNoise, rng: np.random.Generator
) -> HazardGaps | None:
    if gaps is None:
        return None
    shaken = {
        name: _moved(mm, noise.offset_mm * float(rng.standard_normal()), noise, rng)
        for name, mm in gaps.gap_mm.items()
    }
    return replace(gaps, gap_mm=shaken)
