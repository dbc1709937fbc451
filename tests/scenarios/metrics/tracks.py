"""Tracks whose metrics are known."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from scenarios.metrics import Measured, Track
from scenarios.metrics.recorded import rolled_frames

Doubles = NDArray[np.float64]

NO_TRACK = Track(np.empty(0), np.empty((0, 3)), np.empty((0, 4)), np.empty(0, np.int64))

REACH_S, REACH_MM = 1.0, 20.0


def track(
    time_s: ArrayLike, tip_mm: ArrayLike, pointing: ArrayLike = (0.0, 1.0, 0.0)
) -> Track:
    """A tool without roll that points posteriorly unless told otherwise."""
    times, tips = np.asarray(time_s, float), np.asarray(tip_mm, float)
    axes = np.broadcast_to(np.asarray(pointing, float), tips.shape)
    return Track.of_frames(times, rolled_frames(tips, axes, np.zeros(len(times))))


def of_scope(scope: Track, tool: Track = NO_TRACK, **more: Any) -> Measured:
    """What is known of a scope alone."""
    return Measured(scope, tool, **more)


def minimum_jerk(rate_hz: float, pause_s: float = 0.0) -> tuple[Doubles, Doubles]:
    """Times and positions along x of a reach of least jerk, then rest."""
    count = round((REACH_S + pause_s) * rate_hz) + 1
    times = np.arange(count) / rate_hz
    s = np.minimum(times / REACH_S, 1.0)
    x = REACH_MM * (10 * s**3 - 15 * s**4 + 6 * s**5)
    return times, np.stack([x, 0 * x, 0 * x], axis=1)


def wander(seconds: float = 8.0, rate_hz: float = 100.0) -> tuple[Doubles, Doubles]:
    """A smooth way through space, slow and fast."""
    times = np.arange(round(seconds * rate_hz) + 1) / rate_hz
    tips = np.stack(
        [
            12 * np.sin(1.1 * times),
            9 * np.cos(0.7 * times) + 6 * np.sin(2.3 * times),
            5 * np.sin(1.7 * times + 0.4),
        ],
        axis=1,
    )
    return times, tips


def swaying(times: Doubles) -> Doubles:
    """Directions that sway about posterior."""
    axes = np.stack(
        [0.3 * np.sin(1.3 * times), np.ones_like(times), 0.2 * np.cos(0.9 * times)],
        axis=1,
    )
    length = np.linalg.norm(axes, axis=1, keepdims=True)
    return np.asarray(axes / length)


def moved(old: Track, turn: Rotation, shift: Doubles) -> Track:
    """The same motion elsewhere, otherwise turned."""
    return Track(
        old.time_s,
        turn.apply(old.tip_mm) + shift,
        (turn * Rotation.from_quat(old.quaternion)).as_quat(),
        old.part,
    )


def joined(tracks: list[Track]) -> Track:
    """Tracks as one, in order."""
    return Track(
        np.concatenate([t.time_s for t in tracks]),
        np.concatenate([t.tip_mm for t in tracks]),
        np.concatenate([t.quaternion for t in tracks]),
        np.concatenate([t.part for t in tracks]),
    )
