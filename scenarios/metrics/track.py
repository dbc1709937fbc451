"""Where a tool was: recorded poses, and evenly sampled, low-passed pieces of them."""

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from scenarios.metrics.settings import Settings
from system import UserError

Doubles = NDArray[np.float64]

LEAST_SAMPLES = 4
"""A piece of fewer samples has no third difference and is not filtered."""

LOST_MM = 1e5
"""No tracker sees so far: some say so that they miss a tool."""

_FINER = 20
"""At most so many times the metrics' rate is kept before the low-pass."""


@dataclass(frozen=True)
class Track:
    """The recorded poses of one tool, in the patient's frame, LPS mm.

    time_s: ``(n,)``. tip_mm: ``(n, 3)``. quaternion: ``(n, 4)`` x y z w of
    world_from_tool, whose +z runs back up the shaft. part: ``(n,)`` int; a new number
    begins a new tool, and no way is measured from the one to the other. camera_deg:
    ``(n,)`` a scope's camera head from upright; None where it is upright throughout.
    """

    time_s: Doubles
    tip_mm: Doubles
    quaternion: Doubles
    part: NDArray[np.int64]
    camera_deg: Doubles | None = None

    def __post_init__(self) -> None:
        count = len(self.time_s)
        for name, wanted in (
            ("tip_mm", (count, 3)),
            ("quaternion", (count, 4)),
            ("part", (count,)),
            ("camera_deg", (count,)),
        ):
            if getattr(self, name) is None:
                continue
            shape = getattr(self, name).shape
            if shape != wanted:
                raise UserError(f"{name} of {count} samples has the shape {shape}")

    @classmethod
    def of_frames(
        cls, time_s: Doubles, frames: Doubles, part: NDArray[np.int64] | None = None
    ) -> "Track":
        """Take 4x4 poses ``(n, 4, 4)``; one that is no pose becomes NaN."""
        quaternion = np.full((len(time_s), 4), np.nan)
        turns = frames[:, :3, :3]
        known = np.flatnonzero(np.isfinite(turns).all(axis=(1, 2)))
        good = known[np.abs(np.linalg.det(turns[known]) - 1.0) < 1e-3]
        if len(good):
            quaternion[good] = Rotation.from_matrix(turns[good]).as_quat()
        if part is None:
            part = np.zeros(len(time_s), np.int64)
        return cls(time_s, frames[:, :3, 3].copy(), quaternion, part)

    @classmethod
    def none(cls) -> "Track":
        """Return the track of a tool that was never there."""
        nowhere = np.zeros((0, 3)), np.zeros((0, 4))
        return cls(np.zeros(0), *nowhere, np.zeros(0, np.int64))

    @cached_property
    def valid(self) -> NDArray[np.intp]:
        """Return where samples are poses and time goes on."""
        good = np.isfinite(self.time_s) & (np.abs(self.tip_mm) < LOST_MM).all(axis=1)
        good &= np.isfinite(self.quaternion).all(axis=1)
        places = np.flatnonzero(good)
        if len(places) == 0:
            return places
        times = self.time_s[places]
        before = np.maximum.accumulate(np.concatenate([[-np.inf], times[:-1]]))
        return places[times > before]

    def spans(self, gap_s: float) -> list[NDArray[np.intp]]:
        """Return the samples' places, split where the tool was away or changed."""
        places = self.valid
        if len(places) == 0:
            return []
        apart = (np.diff(self.time_s[places]) > gap_s) | (
            np.diff(self.part[places]) != 0
        )
        return np.split(places, np.flatnonzero(apart) + 1)

    def pieces(self, settings: Settings) -> list["Piece"]:
        """Return the evenly sampled pieces; those that are too short are left out."""
        found = []
        for places in self.spans(settings.gap_s):
            piece = _piece(self, places, settings)
            if piece is not None:
                found.append(piece)
        return found

    def smoothed(self, settings: Settings) -> "Track":
        """Return the low-passed poses at the recorded times.

        Stretches that are too short to filter stay as they are.
        """
        tip, quaternion = self.tip_mm.copy(), self.quaternion.copy()
        for places in self.spans(settings.gap_s):
            piece = _piece(self, places, settings)
            if piece is None:
                continue
            times, even = self.time_s[places], piece.time_s
            columns = np.concatenate([piece.tip_mm, piece.quaternion], axis=1).T
            read = np.stack([np.interp(times, even, c) for c in columns], axis=1)
            tip[places] = read[:, :3]
            turned = read[:, 3:]
            quaternion[places] = turned / np.linalg.norm(turned, axis=1, keepdims=True)
        return replace(self, tip_mm=tip, quaternion=quaternion)


@dataclass(frozen=True)
class Piece:
    """A stretch of a track without gaps, sampled evenly and low-passed.

    begin_s: time of the first sample; rate_hz. tip_mm: ``(n, 3)``; quaternion:
    ``(n, 4)`` unit, without sign changes. camera_turn_deg: ``(n,)`` of the camera head,
    None where it is upright.
    """

    begin_s: float
    rate_hz: float
    tip_mm: Doubles
    quaternion: Doubles
    camera_turn_deg: Doubles | None = None

    @property
    def camera_deg(self) -> Doubles:
        """Return the camera head's turn from upright, ``(n,)``."""
        if self.camera_turn_deg is None:
            return np.zeros(len(self.tip_mm))
        return self.camera_turn_deg

    @property
    def duration_s(self) -> float:
        """Return the time from the first sample to the last."""
        return (len(self.tip_mm) - 1) / self.rate_hz

    @cached_property
    def time_s(self) -> Doubles:
        """Return the samples' times ``(n,)``."""
        return self.begin_s + np.arange(len(self.tip_mm)) / self.rate_hz

    @cached_property
    def steps_mm(self) -> Doubles:
        """Return the way from each sample to the next, ``(n - 1, 3)``."""
        return np.diff(self.tip_mm, axis=0)

    @cached_property
    def way_mm(self) -> Doubles:
        """Return the length of the path up to each sample, ``(n,)``."""
        return np.concatenate([[0.0], np.cumsum(lengths(self.steps_mm))])

    @cached_property
    def speed_mm_s(self) -> Doubles:
        """Return the speed between samples, ``(n - 1,)``."""
        return lengths(self.steps_mm) * self.rate_hz

    @cached_property
    def turn_deg_s(self) -> Doubles:
        """Return the angular speed between samples, ``(n - 1,)``."""
        return turns_deg(self.quaternion) * self.rate_hz

    @cached_property
    def back(self) -> Doubles:
        """Return the unit direction back up the shaft, ``(n, 3)``."""
        return third_column(self.quaternion)


def lengths(vectors: Doubles) -> Doubles:
    """Return the lengths ``(n,)`` of vectors ``(n, 3)``."""
    x, y, z = vectors.T
    return np.asarray(np.sqrt(x * x + y * y + z * z))


def turns_deg(quaternion: Doubles) -> Doubles:
    """Return the angles between successive orientations, 0 to 180 degrees, ``(n-1,)``.

    By the chord between unit quaternions, which keeps small angles exact.
    """
    first, second = quaternion[:-1], quaternion[1:]
    sign = np.where(np.einsum("ij,ij->i", first, second) < 0.0, -1.0, 1.0)
    chord = np.linalg.norm(second - sign[:, None] * first, axis=1)
    return np.asarray(np.degrees(4.0 * np.arcsin(np.clip(chord / 2.0, 0.0, 1.0))))


def third_column(quaternion: Doubles) -> Doubles:
    """Return the z axes ``(n, 3)`` of orientations ``(n, 4)``, x y z w."""
    x, y, z, w = quaternion.T
    column = [2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)]
    return np.asarray(np.stack(column, axis=1))


def second_column(quaternion: Doubles) -> Doubles:
    """Return the y axes ``(n, 3)`` of orientations ``(n, 4)``, x y z w."""
    x, y, z, w = quaternion.T
    column = [2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)]
    return np.asarray(np.stack(column, axis=1))


def low_pass(values: Doubles, rate_hz: float, settings: Settings) -> Doubles:
    """Filter ``(n, k)`` evenly sampled values forwards and backwards: no delay."""
    sections = _sections(settings.filter_order, settings.cutoff_hz, rate_hz)
    # the customary three time constants, as far as there are samples
    padding = min(round(rate_hz / settings.cutoff_hz), len(values) - 1)
    # loaded where it is needed: it takes a second, and no flight waits for it
    from scipy.signal import sosfiltfilt

    filtered: Doubles = sosfiltfilt(sections, values, axis=0, padlen=padding)
    return filtered


@lru_cache(maxsize=16)
def _sections(order: int, cutoff_hz: float, rate_hz: float) -> Doubles:
    from scipy.signal import butter

    sections: Doubles = butter(order, cutoff_hz, fs=rate_hz, output="sos")
    return sections


def _piece(track: Track, places: NDArray[np.intp], settings: Settings) -> Piece | None:
    times = track.time_s[places]
    if len(times) < LEAST_SAMPLES:
        return None
    native_hz = 1.0 / float(np.median(np.diff(times)))
    finer = int(np.clip(np.ceil(native_hz / settings.rate_hz - 0.05), 1, _FINER))
    rate_hz = finer * settings.rate_hz
    duration_s = float(times[-1] - times[0])
    count = int(duration_s * rate_hz * (1.0 + 1e-12) + 1e-6) + 1
    if (count - 1) // finer + 1 < LEAST_SAMPLES:
        return None
    even = times[0] + np.arange(count) / rate_hz
    quaternion = track.quaternion[places]
    flips = np.einsum("ij,ij->i", quaternion[:-1], quaternion[1:]) < 0.0
    sign = np.where(np.concatenate([[False], np.cumsum(flips) % 2 == 1]), -1.0, 1.0)
    parts = [track.tip_mm[places], sign[:, None] * quaternion]
    if track.camera_deg is not None:
        parts.append(np.unwrap(track.camera_deg[places], period=360.0)[:, None])
    columns = np.concatenate(parts, axis=1)
    sampled = np.stack([np.interp(even, times, column) for column in columns.T], axis=1)
    smooth = low_pass(sampled, rate_hz, settings)[::finer]
    turned = smooth[:, 3:7]
    turned = turned / np.linalg.norm(turned, axis=1, keepdims=True)
    camera_deg = None if track.camera_deg is None else smooth[:, 7]
    return Piece(float(times[0]), settings.rate_hz, smooth[:, :3], turned, camera_deg)
