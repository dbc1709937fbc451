"""The sphenoid bone about its sinus, and the fossae beside it; both sides alike."""

from anatomy.phantom.fixed_shapes import SHAPES
from anatomy.phantom.orbit import lateral_plane
from anatomy.phantom.parameters import PhantomParameters
from anatomy.phantom.plates import below_base
from anatomy.phantom.shapes import (
    Chain,
    Ellipsoid,
    Field,
    Table,
    U,
    as_field,
    depth_table,
    height_table,
    smooth_max,
    smooth_min,
    u,
    y,
    z,
)
from anatomy.phantom.warp import Warp


def corpus(parameters: PhantomParameters) -> Field:
    """Build the body from the sinus's face to the clivus, under planum and sella."""
    half: Field = depth_table([56, 61, 68, 78, 92], [13.2, 15.2, 14.0, 13.4, 15.0], 3.0)
    half = half + height_table([16, 24, 32, 40], [-5.0, -0.5, 0.0, 0.5], 4.0)
    floor = depth_table([55, 66, 78, 95], [21.0, 18.6, 15.0, 6.0], 4.0)
    body = smooth_max(5.0, u - half, floor - z)
    body = smooth_max(4.0, body, smooth_max(4.0, y + 56.0, -95.0 - y))
    return smooth_max(1.5, body, -below_base(parameters))


def dorsum() -> Field:
    """Build the sella's rear wall with the posterior clinoid processes."""
    top = Table(U, (0, 5, 7.5, 10), (45.2, 45.8, 46.6, 38.0), 1.5)
    thick = height_table([38, 47], [4.0, 1.2], 2.0)
    slab = smooth_max(1.0, abs(y + 81.2) - thick, z - top)
    return smooth_max(1.5, slab, smooth_max(1.0, 36.0 - z, u - 9.0))


def pterygoid() -> Field:
    """Build the pterygoid process: its root and its two plates.

    The medial plate goes on behind the nose's side wall, the lateral one flares.
    """
    low = smooth_max(1.0, -6.0 - z, z - 24.0)
    flat = as_field(0.0)
    bow = height_table([-6, 6, 16, 24], [-0.5, 0.5, 0.3, -0.3], 4.0)
    flare = height_table([-6, 4, 14, 24], [-3.0, 0.2, 0.9, 0.0], 4.0)
    medial = Warp(bow, flat, -z, Chain(((14.4, -55, 0), (14.9, -63, 0)), (0.6, 0.4)))
    lateral = Warp(flare, flat, -z, Chain(((16.5, -55, 0), (21.5, -65, 0)), (0.7, 0.4)))
    plates = smooth_max(2.0, smooth_min(0.6, medial, lateral), low)
    return smooth_min(1.0, SHAPES["pterygoid root"], plates)


def temporal_lobe() -> Field:
    """Build the lobe in the middle fossa, its pole behind the orbit."""
    pole = smooth_max(
        5.0, Ellipsoid((36, -81, 42), (17.5, 34, 19)), 6.0 - lateral_plane()
    )
    return smooth_min(6.0, pole, Ellipsoid((41, -86, 42), (20, 25, 21)))
