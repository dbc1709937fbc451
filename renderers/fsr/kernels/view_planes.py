"""A camera in terms of a set's grid, and planes around strips of its picture.

A view's own planes ask where a splat is; a strip must not lose one whose footprint
reaches it, or bits would depend on how a picture is shared out. A footprint is the
affine map at the splat's centre, and off the axis it is wider than the splat seen from
the eye. With r what a splat reaches in mm, d its distance, y and z its place above the
axis and along it:

- a flat view draws it as wide as it is;
- a pinhole draws it up to r sqrt(1 + (y/z)^2) / z high. Within the planes of the view
  no splat from a distance on has a steeper y/z than found below;
- an equidistant lens draws it up to r / d times theta / sin(theta) in radians, which is
  below two where theta is below 108 degrees, and the lens brings no two directions
  nearer to one another than they are.

So planes through the eye, moved out by r times a factor, keep what they must. Moved out
by a distance they keep all that is as near.
"""

import math
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.fsr.view_limits import SOFT_PX, STEEPEST_CONE_RAD

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]

EQUIDISTANT, PERSPECTIVE, ORTHOGRAPHIC = 0, 1, 2

EQUIDISTANT_FACTOR = 2.0

WIDEST_BALL_RAD = 0.3
"""Angle of a splat up to which the factor above holds beside the steepest cone."""

ROUNDED_MM = 1e-3
"""More than single precision moves a plane."""


@njit(cache=True, nogil=True, error_model="numpy")
def see_grid(frame: F64, flat: bool, grid: Any) -> Any:
    """Give base, matrix, low and high, see `View`.

    frame: ``(4, 3)`` eye, right, up, forward. grid: see `Grid`.
    """
    voxel_from_world, axes_mm, top, corners_mm, middle_mm, radius_mm = grid
    eye = frame[0]
    voxel, base = np.empty(3), np.empty(3)
    for c in range(3):
        place = voxel_from_world[c, 3]
        for k in range(3):
            place += voxel_from_world[c, k] * eye[k]
        voxel[c] = place
        base[c] = min(max(np.rint(place), 0.0), top[c])
    matrix = np.zeros((3, 4))
    for axis in range(3):
        for c in range(3):
            for k in range(3):
                matrix[axis, c] += frame[axis + 1, k] * axes_mm[k, c]
            matrix[axis, 3] += matrix[axis, c] * (base[c] - voxel[c])
    low, high = np.inf, -np.inf
    for corner in range(corners_mm.shape[1]):
        depth = 0.0
        for k in range(3):
            away = corners_mm[k, corner] - eye[k]
            depth += away * (frame[3, k] if flat else away)
        low, high = min(low, depth), max(high, depth)
    if not flat:
        # the grid lies in the ball around its middle that holds its corners
        square = 0.0
        for k in range(3):
            square += (middle_mm[k] - eye[k]) ** 2
        low, high = max(math.sqrt(square) - radius_mm, 0.0), math.sqrt(high)
    return base.astype(np.float32), matrix.astype(np.float32), low, high


@njit(cache=True, nogil=True, error_model="numpy")
def bring_into_grid(
    lens: F64, frame: F64, margin_mm: float, world_from_voxel: F64, base: F32,
    planes: F32,
) -> None:  # fmt: skip
    """Bring planes of the camera's frame into grid places counted from `base`.

    lens: ``(p, 4)`` by right, up, forward and mm from the eye. margin_mm: by which they
    are moved out. planes: as many rows, written to.
    """
    world = np.empty(3)
    for p in range(lens.shape[0]):
        offset = lens[p, 3] + margin_mm + ROUNDED_MM
        for k in range(3):
            world[k] = 0.0
            for axis in range(3):
                world[k] += lens[p, axis] * frame[axis + 1, k]
            offset += world[k] * (world_from_voxel[k, 3] - frame[0, k])
        for c in range(3):
            slope = 0.0
            for k in range(3):
                slope += world[k] * world_from_voxel[k, c]
            offset += slope * base[c]
            planes[p, c] = slope
        planes[p, 3] = offset


@njit(cache=True, nogil=True, error_model="numpy")
def reach_factor(
    projection: int, extent: float, width: int, height: int, radius_mm: float,
    from_mm: float,
) -> float:  # fmt: skip
    """Give how far a footprint reaches, in radii; infinity where there is no bound.

    Of splats that are at least so far away.
    """
    if projection == ORTHOGRAPHIC:
        return 1.0
    half = min(width, height) / 2
    if projection == EQUIDISTANT:
        # splats may lie beside the corner by their radius
        is_narrow = _corner_rad(extent, width, height) < STEEPEST_CONE_RAD
        is_small = radius_mm < math.sin(WIDEST_BALL_RAD) * from_mm
        return EQUIDISTANT_FACTOR if is_narrow and is_small else math.inf
    slope = math.tan(extent)
    wide = slope * (width / 2 + SOFT_PX) / half
    high = slope * (height / 2 + SOFT_PX) / half
    # within the view's planes |x| <= wide z + a, |y| <= high z + b: the least z at a
    # distance solves x^2 + y^2 + z^2 = from_mm^2 there
    a, b = radius_mm * math.hypot(1.0, wide), radius_mm * math.hypot(1.0, high)
    square, linear = 1 + wide**2 + high**2, wide * a + high * b
    rest = a**2 + b**2 - from_mm**2
    if rest >= 0:
        return math.inf
    least_z = (math.sqrt(linear**2 - square * rest) - linear) / square
    return math.hypot(1.0, high + b / least_z)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _corner_rad(extent: float, width: int, height: int) -> float:
    half = min(width, height) / 2
    return extent * math.hypot(width / 2 + SOFT_PX, height / 2 + SOFT_PX) / half


@njit(cache=True, nogil=True, error_model="numpy")
def strip_planes(
    projection: int, extent: float, width: int, height: int, first: int, end: int,
    radius_mm: float, least_mm: float, nearest_mm: float,
) -> F64:  # fmt: skip
    """Bound what may show in lines of pixels above and below: ``(p, 4)``.

    By right, up, forward and mm from the eye. For splats of `radius_mm` that are within
    the view's planes; there are none nearer than `nearest_mm`, and those nearer than
    `least_mm`, for which a footprint's law may not hold, are all kept. No planes where
    there is no bound.
    """
    middle, half = height / 2, min(width, height) / 2
    factor = reach_factor(
        projection, extent, width, height, radius_mm, max(least_mm, nearest_mm)
    )
    planes = np.zeros((2, 4))
    if factor == math.inf:
        return planes[:0]
    margin_mm = factor * radius_mm
    if least_mm > nearest_mm:
        margin_mm = max(margin_mm, least_mm)
    for p in range(2):
        side = 2 * p - 1
        # how far up, or down, a footprint may begin: as an angle, a tangent or in mm
        pixels = SOFT_PX + (end - middle if p else middle - first)
        steep = offset = 0.0
        if projection == ORTHOGRAPHIC:
            offset = extent * pixels / half
        elif projection == PERSPECTIVE:
            steep = math.tan(extent) * pixels / half
        else:
            angle = extent * pixels / half
            # aside of the middle the cone of a line is bent away from the middle: a
            # plane through its top leaves all beyond it out; before it one is needed
            # through where it meets the farthest corner
            widest = _corner_rad(extent, width, height)
            steep = math.tan(angle) if angle < 0 else angle * math.tan(widest) / widest
        size = math.hypot(1.0, steep)
        planes[p, 1] = side / size
        planes[p, 2] = steep / size
        planes[p, 3] = offset + margin_mm
    return planes
