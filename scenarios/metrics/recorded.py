"""Tracks of recorded samples."""

import numpy as np
from numpy.typing import NDArray

from scenarios.endoscope import ANTERIOR, PARALLEL, SUPERIOR
from scenarios.metrics.track import Track, lengths
from scenarios.sample_columns import SampleColumns

Doubles = NDArray[np.float64]


def scope_track(samples: SampleColumns, world_from_device: Doubles) -> Track:
    """Return the scope's track; y of its frame is the light post.

    The arm does not measure its turn: that comes from `Sample.roll_deg`.
    """
    if not len(samples):
        return _no_track()
    frames = world_from_device @ samples.device_from_tip
    posed = rolled_frames(frames[:, :3, 3], -frames[:, :3, 2], samples.roll_deg)
    return Track.of_frames(samples.time_s, posed)


def tool_track(samples: SampleColumns) -> Track:
    """Return the track of what the second hand holds, as `tool_frame` poses it.

    Another tool begins another part; an empty hand has no samples.
    """
    held = np.flatnonzero(samples.is_held)
    if len(held) == 0:
        return _no_track()
    tool = samples.tool[held]
    part = np.cumsum(np.diff(tool, prepend=tool[:1]) != 0)
    posed = rolled_frames(
        samples.tool_mm[held], samples.tool_pointing[held], samples.tool_roll_deg[held]
    )
    return Track.of_frames(samples.time_s[held], posed, part.astype(np.int64))


def rolled_frames(tip_mm: Doubles, pointing: Doubles, roll_deg: Doubles) -> Doubles:
    """Return world_from_tool ``(n, 4, 4)``: +z back up the shaft, +y the rolled "up".

    roll_deg: ``(n,)`` right-handed about the pointing direction ``(n, 3)``.
    """
    with np.errstate(invalid="ignore", divide="ignore"):
        forward = pointing / lengths(pointing)[:, None]
        right, up = upright(forward)
    turn = np.radians(roll_deg)[:, None]
    frames = np.zeros((len(tip_mm), 4, 4))
    frames[:, :3, 0] = np.cos(turn) * right - np.sin(turn) * up
    frames[:, :3, 1] = np.cos(turn) * up + np.sin(turn) * right
    frames[:, :3, 2] = -forward
    frames[:, :3, 3] = tip_mm
    frames[:, 3, 3] = 1.0
    return frames


def upright(forward: Doubles) -> tuple[Doubles, Doubles]:
    """Return unit right and up ``(n, 3)`` of pictures along unit axes ``(n, 3)``.

    As `Endoscope.camera` has them.
    """
    steep = np.abs(forward @ SUPERIOR) >= PARALLEL
    right = np.cross(forward, np.where(steep[:, None], ANTERIOR, SUPERIOR))
    right = right / lengths(right)[:, None]
    return right, np.cross(right, forward)


def _no_track() -> Track:
    return Track(np.empty(0), np.empty((0, 3)), np.empty((0, 4)), np.empty(0, np.int64))
