"""A camera in terms of a set's grid, and planes around its view and bands of it.

A view's own planes bound where a splat is; a band must not lose one whose footprint
reaches it, or bits would depend on how a picture is shared out. A footprint is the
affine map at the splat's centre, and off the axis it is wider than the splat seen from
the eye. With r the splat's radius in mm, d its distance, y and z its place above the
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
from typing import NamedTuple

import numpy as np
from numba import njit

from renderers.fsr.kernels.array_types import F32, F64, Lanes, Real

EQUIDISTANT, PERSPECTIVE, ORTHOGRAPHIC = 0, 1, 2

SOFT_PX = 2.0
"""More than the softening of footprints adds to their reach: 3 sqrt(.3) at most."""
STEEPEST_CONE_RAD = math.radians(89.0)
"""A wider cone is not convex or nearly flat: nothing is culled sideways then."""
EQUIDISTANT_FACTOR = 2.0
WIDEST_BALL_RAD = 0.3
"""Angle of a splat up to which the factor above holds beside the steepest cone."""
ROUNDED_MM = 1e-3
"""More than single precision moves a plane."""


class Lens(NamedTuple):
    """The lens of a camera; see `Camera`."""

    projection: int
    extent: float
    width: int
    height: int


class Grid(NamedTuple):
    """What all views of a set share.

    axes_mm: ``(3, 3)`` steps of i, j, k in columns. voxel_from_world: ``(3, 4)``. top:
    the last grid point. corners_mm: ``(3, 8)`` of the outermost voxels; middle_mm,
    radius_mm: the ball through them.
    """

    axes_mm: F64
    voxel_from_world: F64
    top: F64
    corners_mm: F64
    middle_mm: F64
    radius_mm: float


class GridView(NamedTuple):
    """A camera in terms of a grid.

    base: the grid point next to the eye; places are counted from it, so that near
    splats keep their digits. matrix: ``(3, 4)``, camera frame from grid steps away from
    it. scale: pixels per radian, tangent or mm. low: least depth (mm) in the grid;
    depth is along the view axis in a flat view, else the distance. keys_per_mm: from
    depth to sorting keys. near_mm: splats nearer than this are drawn first.
    """

    base: F32
    matrix: F32
    projection: int
    scale: np.float32
    width: int
    height: int
    low: np.float32
    keys_per_mm: np.float32
    near_mm: np.float32


@njit(cache=True, nogil=True, error_model="numpy")
def see_grid(frame: F64, flat: bool, grid: Grid) -> tuple[F32, F32, float, float]:
    """Return base and matrix of a `GridView`, and the grid's least and greatest depth.

    frame: ``(4, 3)`` eye, right, up, forward.
    """
    axes_mm, voxel_from_world, top, corners_mm, middle_mm, radius_mm = grid
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


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def depth_of(dx: Real, dy: Real, dz: Real, m: F32, flat: bool) -> Lanes:
    """Return steps' distance from the eye, or along a flat view."""
    z = dx * m[2, 0] + dy * m[2, 1] + dz * m[2, 2] + m[2, 3]
    if flat:
        return z
    x = dx * m[0, 0] + dy * m[0, 1] + dz * m[0, 2] + m[0, 3]
    y = dx * m[1, 0] + dy * m[1, 1] + dz * m[1, 2] + m[1, 3]
    return np.float32(math.sqrt(x * x + y * y + z * z))


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
def reach_factor(lens: Lens, radius_mm: float, from_mm: float) -> float:
    """Return how far a footprint reaches, in radii; infinity where there is no bound.

    Of splats that are at least so far away.
    """
    projection, extent, width, height = lens
    if projection == ORTHOGRAPHIC:
        return 1.0
    half = min(width, height) / 2
    if projection == EQUIDISTANT:
        # splats may lie beside the corner by their radius
        is_narrow = _corner_rad(lens) < STEEPEST_CONE_RAD
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
def _corner_rad(lens: Lens) -> float:
    half = min(lens.width, lens.height) / 2
    corner = math.hypot(lens.width / 2 + SOFT_PX, lens.height / 2 + SOFT_PX)
    return lens.extent * corner / half


@njit(cache=True, nogil=True, error_model="numpy")
def band_planes(
    lens: Lens, first: int, end: int, radius_mm: float, least_mm: float,
    nearest_mm: float,
) -> F64:  # fmt: skip
    """Bound what may show in lines of pixels above and below: ``(p, 4)``.

    By right, up, forward and mm from the eye. For splats of `radius_mm` that are within
    the view's planes; there are none nearer than `nearest_mm`, and those nearer than
    `least_mm`, for which a footprint's law may not hold, are all kept. No planes where
    there is no bound.
    """
    projection, extent, width, height = lens
    middle, half = height / 2, min(width, height) / 2
    factor = reach_factor(lens, radius_mm, max(least_mm, nearest_mm))
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
            widest = _corner_rad(lens)
            steep = math.tan(angle) if angle < 0 else angle * math.tan(widest) / widest
        size = math.hypot(1.0, steep)
        planes[p, 1] = side / size
        planes[p, 2] = steep / size
        planes[p, 3] = offset + margin_mm
    return planes
