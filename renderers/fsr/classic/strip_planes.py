"""Planes around what may show in a strip of a picture's lines.

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

import numpy as np
from numpy.typing import NDArray

from renderers.fsr.display_list import SOFT_PX, STEEPEST_CONE_RAD
from renderers.scene import Camera, Projection

EQUIDISTANT_FACTOR = 2.0


def strip_planes(
    camera: Camera, lines: range, radius_mm: float, least_mm: float, nearest_mm: float
) -> NDArray[np.float64]:
    """Bound what may show in lines of pixels above and below: world planes ``(p, 4)``.

    For splats of `radius_mm` that are within `view_planes`; there are none nearer than
    `nearest_mm`, and those nearer than `least_mm`, for which a footprint's law may not
    hold, are all kept. See `view_planes` for the form of planes.
    """
    middle, half = camera.height / 2, min(camera.width, camera.height) / 2
    factor = _factor(camera, radius_mm, max(least_mm, nearest_mm))
    if factor is None:
        return np.empty((0, 4))
    margin_mm = factor * radius_mm
    if least_mm > nearest_mm:
        margin_mm = max(margin_mm, least_mm)
    eye, _, up, forward = camera.frame
    planes = []
    for side, pixels in ((-1.0, middle - lines.start), (1.0, lines.stop - middle)):
        # how far up, or down, a footprint may begin: as an angle, a tangent or in mm
        steep = offset = 0.0
        if camera.projection is Projection.ORTHOGRAPHIC:
            offset = camera.extent * (pixels + SOFT_PX) / half
        elif camera.projection is Projection.PERSPECTIVE:
            steep = math.tan(camera.extent) * (pixels + SOFT_PX) / half
        else:
            angle = camera.extent * (pixels + SOFT_PX) / half
            # aside of the middle the cone of a line is bent away from the middle: a
            # plane through its top leaves all beyond it out; before it one is needed
            # through where it meets the farthest corner
            widest = _corner_rad(camera)
            steep = math.tan(angle) if angle < 0 else angle * math.tan(widest) / widest
        world = (side * up + steep * forward) / math.hypot(1.0, steep)
        planes.append([*world, offset + margin_mm - world @ eye])
    return np.array(planes)


def _corner_rad(camera: Camera) -> float:
    half = min(camera.width, camera.height) / 2
    corner = math.hypot(camera.width / 2 + SOFT_PX, camera.height / 2 + SOFT_PX)
    return camera.extent * corner / half


def _factor(camera: Camera, radius_mm: float, from_mm: float) -> float | None:
    """Give how far a footprint may reach, in radii; None where there is no bound."""
    if camera.projection is Projection.ORTHOGRAPHIC:
        return 1.0
    if camera.projection is Projection.EQUIDISTANT:
        # splats may lie beside the corner by their radius
        beside = math.asin(min(radius_mm / max(from_mm, 1e-9), 1.0))
        is_narrow = _corner_rad(camera) < STEEPEST_CONE_RAD and beside < 0.3
        return EQUIDISTANT_FACTOR if is_narrow else None
    half = min(camera.width, camera.height) / 2
    slope = math.tan(camera.extent)
    wide = slope * (camera.width / 2 + SOFT_PX) / half
    high = slope * (camera.height / 2 + SOFT_PX) / half
    # within the view's planes |x| <= wide z + a, |y| <= high z + b: the least z at a
    # distance solves x^2 + y^2 + z^2 = from_mm^2 there
    a, b = radius_mm * math.hypot(1.0, wide), radius_mm * math.hypot(1.0, high)
    square, linear = 1 + wide**2 + high**2, wide * a + high * b
    rest = a**2 + b**2 - from_mm**2
    if rest >= 0:
        return None
    least_z = (math.sqrt(linear**2 - square * rest) - linear) / square
    return math.hypot(1.0, high + b / least_z)
