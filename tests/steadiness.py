"""How steady a moving picture is: a frame against the one before, carried along.

What a surface shows should move with it. A frame is predicted from the one before by
following every pixel to where its surface point was; what the prediction misses is
flicker, popping or shimmer, but for glints, which slide by right.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import (
    binary_dilation,
    map_coordinates,
    maximum_filter,
    minimum_filter,
)

from renderers.scene import Camera, GBuffer

SAME_MM = 0.2
"""A point whose depth in the frame before is off by more was hidden there."""

RIM_PX = 2
"""Pixels beside an edge show a mixture."""

WITHIN = 0.96
"""Radius of the field that counts: the stop stands still while the picture moves."""

GLINT_CODE = 225
"""A pixel all of whose channels reach this is a glint."""


@dataclass(frozen=True, slots=True)
class Change:
    """How a frame differs from the one before, carried along.

    mean, p99: 8-bit codes, of the largest channel's absolute difference, over pixels
    that both frames show away from edges. share: of the field's pixels that is.
    """

    mean: float
    p99: float
    share: float


def carried(
    picture: NDArray[np.float64], before: Camera, gbuffer_before: GBuffer,
    camera: Camera, gbuffer: GBuffer,
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:  # fmt: skip
    """Give what a frame ``(h, w, 3)`` predicts for the next, and where it can."""
    origin, ray = camera.rays()
    met = gbuffer.coverage > 0
    points = origin + np.where(met, gbuffer.depth_mm, 0)[..., None] * ray
    position, away = before.project(points)
    at = np.stack([position[..., 1] - 0.5, position[..., 0] - 0.5])
    there = np.where(gbuffer_before.coverage > 0, gbuffer_before.depth_mm, 0.0)
    known = map_coordinates(there, at, order=1, mode="constant")
    sound = _is_sound(gbuffer_before).astype(np.float64)
    was_sound = map_coordinates(sound, at, order=1, mode="constant") > 0.99
    usable = _is_sound(gbuffer) & was_sound & (np.abs(known - away) < SAME_MM)
    channels = [
        map_coordinates(picture[..., c], at, order=1, mode="nearest") for c in range(3)
    ]
    return np.stack(channels, axis=-1), usable


def change(
    picture: NDArray[np.float64], predicted: NDArray[np.float64],
    usable: NDArray[np.bool_], camera: Camera,
) -> Change:  # fmt: skip
    """Compare a frame with its prediction where it can be."""
    off = np.abs(picture - predicted).max(axis=-1)[usable]
    field = np.count_nonzero(np.any(camera.lens_table() != 0, axis=-1))
    return Change(
        float(off.mean()), float(np.percentile(off, 99)), usable.sum() / field
    )


def glints(picture: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Tell where a picture of codes glints."""
    return np.asarray(picture.min(axis=-1) >= GLINT_CODE)


def _is_sound(gbuffer: GBuffer) -> NDArray[np.bool_]:
    """Tell where a pixel shows one wall alone, away from edges and from the stop."""
    shown = gbuffer.coverage > 0
    depth = np.where(shown, gbuffer.depth_mm, 1e3)
    spread = maximum_filter(depth, 3) - minimum_filter(depth, 3)
    mixed = binary_dilation((spread > 0.4 + 0.06 * depth) | ~shown, iterations=RIM_PX)
    height, width = shown.shape
    y, x = np.mgrid[:height, :width] + 0.5
    r = np.hypot(y - height / 2, x - width / 2) / (min(height, width) / 2)
    return np.asarray(~mixed & (r < WITHIN))


def orbited(camera: Camera, radius_mm: float, step_mm: float) -> Camera:
    """Move a camera sideways about what lies `radius_mm` before it, facing it."""
    eye, right, up, forward = camera.frame
    angle = step_mm / radius_mm
    turned = np.cos(angle) * forward - np.sin(angle) * right
    across = np.cos(angle) * right + np.sin(angle) * forward
    target = eye + radius_mm * forward
    frame = np.stack([target - radius_mm * turned, across, up, turned])
    return camera.moved(frame)


def shifted(camera: Camera, step_mm: float) -> Camera:
    """Move a camera forwards along its view axis."""
    frame = camera.frame.copy()
    frame[0] += step_mm * frame[3]
    return camera.moved(frame)
