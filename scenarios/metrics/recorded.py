"""Tracks of recorded samples."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from scenarios.endoscope import ANTERIOR, PARALLEL, SUPERIOR
from scenarios.instrument_state import NO_TOOL
from scenarios.metrics.measured import ToolUse
from scenarios.metrics.track import Track, lengths
from scenarios.sample_columns import SampleColumns

Doubles = NDArray[np.float64]


def scope_track(samples: SampleColumns, world_from_device: Doubles) -> Track:
    """Return the scope's track; y of its frame is the light post.

    The arm does not measure its turn: that comes from `Sample.roll_deg`. Another scope
    begins another part. What was frozen is left out, and another part begins after it.
    """
    counts = np.flatnonzero(~samples.is_frozen)
    if len(counts) == 0:
        return _no_track()
    frames = world_from_device @ samples.device_from_tip[counts]
    posed = rolled_frames(frames[:, :3, 3], -frames[:, :3, 2], samples.roll_deg[counts])
    part = _parts(samples.scope_deg) + _parts(samples.is_frozen)
    track = Track.of_frames(samples.time_s[counts], posed, part[counts])
    if not samples.camera_deg.any():
        return track
    return replace(track, camera_deg=samples.camera_deg[counts])


def tool_track(samples: SampleColumns) -> Track:
    """Return the track of what the second hand holds, as `tool_frame` poses it.

    Another tool begins another part, and so does what comes after a freeze; an empty
    hand has no samples, nor has a frozen one.
    """
    held = np.flatnonzero(samples.is_held & ~samples.is_frozen)
    if len(held) == 0:
        return _no_track()
    part = _parts(samples.tool[held]) + _parts(samples.is_frozen)[held]
    posed = rolled_frames(
        samples.tool_mm[held], samples.tool_pointing[held], samples.tool_roll_deg[held]
    )
    return Track.of_frames(samples.time_s[held], posed, part)


def scope_changes(
    samples: SampleColumns, angle_deg: float
) -> tuple[tuple[float, float], ...]:
    """Return when a scope of another angle was put in, s, and that angle, in order.

    angle_deg: of the exercise's own.
    """
    own = np.isnan(samples.scope_deg)
    angles = np.where(own, angle_deg, samples.scope_deg)
    changed = np.flatnonzero(np.diff(angles, prepend=angle_deg))
    return tuple((float(samples.time_s[n]), float(angles[n])) for n in changed)


def _parts(held: NDArray[np.generic]) -> NDArray[np.int64]:
    """Return ``(n,)`` numbers that rise where another thing is held; NaN is one."""
    before, now = held[:-1], held[1:]
    changed = (before != now) & ~((before != before) & (now != now))
    return np.concatenate([[0], np.cumsum(changed)]).astype(np.int64)


def tool_use(samples: SampleColumns) -> ToolUse:
    """Return when each tool worked or sucked; what was frozen does not count."""
    used = samples.is_used & ~samples.is_frozen
    times = {
        name: used & (samples.tool == place)
        for place, name in enumerate(samples.names)
        if name != NO_TOOL
    }
    return ToolUse(samples.time_s, {n: when for n, when in times.items() if when.any()})


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
