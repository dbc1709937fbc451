"""Tracks of recorded samples."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from scenarios.endoscope import ANTERIOR, PARALLEL, SUPERIOR
from scenarios.instrument_state import NO_TOOL
from scenarios.metrics.measured import ToolUse
from scenarios.metrics.track import Track, lengths
from scenarios.sample import Sample

Doubles = NDArray[np.float64]


def scope_track(samples: Sequence[Sample], world_from_device: Doubles) -> Track:
    """Return the scope's track; y of its frame is the light post.

    The arm does not measure its turn: that comes from `Sample.roll_deg`. Another scope
    begins another part.
    """
    if not samples:
        return _no_track()
    frames = world_from_device @ np.array([s.device_from_tip for s in samples])
    roll_deg = np.array([s.roll_deg for s in samples])
    times = np.array([s.time_s for s in samples])
    posed = rolled_frames(frames[:, :3, 3], -frames[:, :3, 2], roll_deg)
    part = _parts([s.scope_deg for s in samples])
    camera_deg = np.array([s.camera_roll_deg for s in samples])
    track = Track.of_frames(times, posed, part)
    return replace(track, camera_deg=camera_deg) if camera_deg.any() else track


def tool_track(samples: Sequence[Sample]) -> Track:
    """Return the track of what the second hand holds, as `tool_frame` poses it.

    Another tool begins another part; an empty hand has no samples.
    """
    held = [s for s in samples if s.instrument.name != NO_TOOL]
    if not held:
        return _no_track()
    names = [s.instrument.name for s in held]
    part = _parts(names)
    posed = rolled_frames(
        np.array([s.instrument_tip_mm for s in held]),
        np.array([s.instrument_pointing for s in held]),
        np.array([s.instrument.roll_deg for s in held]),
    )
    times = np.array([s.time_s for s in held])
    return Track.of_frames(times, posed, part)


def scope_changes(
    samples: Sequence[Sample], angle_deg: float
) -> tuple[tuple[float, float], ...]:
    """Return when a scope of another angle was put in, s, and that angle, in order.

    angle_deg: of the exercise's own.
    """
    angles = [angle_deg if s.scope_deg is None else s.scope_deg for s in samples]
    before = [angle_deg, *angles]
    return tuple(
        (sample.time_s, now)
        for sample, now, last in zip(samples, angles, before, strict=False)
        if now != last
    )


def _parts(held: Sequence[object]) -> NDArray[np.int64]:
    """Return ``(n,)`` numbers that rise where another thing is held."""
    changed = [a != b for a, b in zip([held[0], *held], held, strict=False)]
    return np.cumsum(changed).astype(np.int64)


def tool_use(samples: Sequence[Sample]) -> ToolUse:
    """Return when each tool worked or sucked; what was frozen does not count."""
    times = np.array([s.time_s for s in samples])
    used = [
        s.instrument.name
        if (s.instrument.is_working or s.instrument.is_sucking) and not s.is_frozen
        else NO_TOOL
        for s in samples
    ]
    names = [name for name in dict.fromkeys(used) if name != NO_TOOL]
    return ToolUse(times, {n: np.array([u == n for u in used]) for n in names})


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
