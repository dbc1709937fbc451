"""Cheek, palate, tooth-bearing bone, teeth and lower jaw.

Cheeks are askew by a little.
"""

import numpy as np

from anatomy.phantom.fixed_shapes import SHAPES
from anatomy.phantom.maxillary import molar_roots
from anatomy.phantom.parameters import PhantomParameters
from anatomy.phantom.program import Op
from anatomy.phantom.shapes import (
    Affine,
    Chain,
    Combine,
    Ellipsoid,
    Field,
    Point,
    Signed,
    Table,
    U,
    Warp,
    as_field,
    depth_table,
    height_table,
    one_side,
    smooth_max,
    smooth_min,
    u,
    y,
    z,
)
from anatomy.tissue import Side

ASKEW_MM, MOST_ASKEW_MM = 0.8, 1.6
"""Standard deviation and bound of a shift at `SIDE_MM` from the septum: healthy faces
differ by 1 to 2 mm between their sides (recalled)."""

SIDE_MM = 40.0


def askew(field: Field, parameters: PhantomParameters) -> Field:
    """Shift a field that holds both sides, one way on the right, the other on the left.

    The shift is odd and of low order: nothing at the septum, up to `MOST_ASKEW_MM` at
    `SIDE_MM`. The field must not be bent itself.
    """
    rng = np.random.default_rng([parameters.seed, 0x6173])
    drawn = np.clip(rng.normal(0.0, ASKEW_MM, (3, 2)), -MOST_ASKEW_MM, MOST_ASKEW_MM)
    shifts = [
        Combine(
            Op.MULTIPLY,
            Signed(),
            Affine(float(even) / SIDE_MM, (0.0, 0.0, 0.3 * float(tilt) / SIDE_MM**2)),
        )
        for even, tilt in drawn
    ]
    return Warp(shifts[0], shifts[1], shifts[2], field)


def _belly(
    ends: tuple[Point, Point],
    radii: tuple[float, float],
    middle: Field,
    half_mm: float,
) -> Field:
    """Build a flat muscle: a capsule cut to a slab about the surface u = middle."""
    return smooth_max(4.0, Chain(ends, radii), abs(u - middle) - half_mm)


def ramus() -> Field:
    """Build the lower jaw's ascending branch of one side, a plate."""
    middle = depth_table([40, 60, 80], [41.5, 43.8, 45.2], 6.0)
    ends: tuple[Point, Point] = ((45, -60, 20), (43, -60, -28))
    return _belly(ends, (13.0, 15.0), middle, 3.3)


def fat(face: Field) -> Field:
    """Build the fat under the skin, in the cheek and between the muscles of chewing.

    face: the distance from the skin, positive inside.
    """
    under = face - height_table([-60, -20, 10, 30, 60], [3.5, 6.0, 6.4, 3.5, 2.2], 8.0)
    return smooth_min(4.0, under, SHAPES["deep fat"])


def muscles() -> Field:
    """Build the muscles of chewing, of palate, tongue and neck, and of the face."""
    masseter = _belly(
        ((50, -38, 19), (47, -57, -30)),
        (12.0, 13.0),
        depth_table([20, 40, 60, 80], [45.5, 50.5, 51.5, 48.5], 6.0),
        4.6,
    )
    temporal = _belly(
        ((50, -48, 64), (45, -50, 8)),
        (24.0, 7.0),
        height_table([0, 15, 30, 50, 70], [44.5, 45.5, 48, 54, 58], 6.0),
        4.2,
    )
    medial = _belly(
        ((18, -62, 6), (38, -64, -27)),
        (8.0, 10.0),
        height_table([-30, 8], [38.5, 18.5], 4.0),
        3.6,
    )
    cheek = _belly(
        ((24, -40, -8), (18, -12, -14)),
        (9.0, 10.0),
        depth_table([6, 12, 22, 36, 48], [15.5, 21.5, 27.5, 30.0, 27.0], 5.0),
        1.0,
    )
    return smooth_min(
        1.0,
        masseter,
        temporal,
        medial,
        cheek,
        Chain(((18, -58, 15), (31, -66, 18), (43, -72, 20)), (7.0, 6.0, 3.5)),
        Chain(((18, -57, 8), (30, -64, 12), (43, -72, 19)), (4.5, 5.0, 3.0)),
        Chain(((6, -81, 12), (8, -80, -28)), (6.0, 7.0)),
        Chain(((13, -68, 8), (14, -68, -28)), (4.5, 4.0)),
        Chain(((41, -15, 12), (31, -8, -8), (24, -3, -24)), (1.6, 2.0, 1.4)),
        Chain(((22, -5, 18), (17, -1, 0), (14, 2, -14)), (1.4, 1.9, 1.2)),
        Ellipsoid((0, -36, -22), (24, 32, 15)),
        Chain(((0, -50, -2.5), (0, -64, -8)), (5.0, 3.5)),
    )


def facial_sheet(face: Field) -> Field:
    """Build the layer of muscle and fascia under the skin of cheek and eyelids."""
    cheek = smooth_max(
        0.5, abs(face - 3.6) - 0.35, Ellipsoid((44, -42, -2), (28, 42, 36))
    )
    lids = smooth_max(0.5, abs(face - 2.0) - 0.5, Ellipsoid((30, -6, 37), (21, 30, 18)))
    return smooth_min(0.5, cheek, lids)


def zygomatic_suture() -> Field:
    """Build the joint between zygoma and maxilla, a thin curved gap."""
    plane = (u - 33.0) * 0.8 + (y + 15.0) * 0.25 - (z - 14.0) * 0.55
    return smooth_max(0.0, abs(plane) - 0.3, SHAPES["zygoma"])


_CROWNS = (
    (4, -5, 3.4),
    (9.5, -7, 3.0),
    (15, -12, 3.4),
    (19, -19, 4.2),
    (22, -28, 4.6),
    (23.5, -37, 4.4),
)


def palate(face: Field) -> Field:
    """Build the hard palate. face: the distance from the skin, positive inside.

    It is stout behind the incisors and thins towards its rear edge.
    """
    vault: Field = Table(U, (0, 8, 14, 20), (-3.5, -4.2, -6.5, -9.0), 3.0)
    vault = vault + depth_table([6, 16, 34, 49], [-4.0, -0.8, 0.2, 1.6], 3.0)
    plate = smooth_max(3.0, smooth_max(3.0, u - 21.0, z - 0.5), -49.0 - y)
    plate = smooth_max(3.0, plate, y + Table(U, (0, 10, 20, 28), (2, 5, 12, 24)))
    return smooth_max(1.5, smooth_max(1.0, plate, 3.0 - face), vault - z)


def alveolus(face: Field) -> Field:
    """Build the tooth-bearing ridge along the dental arch, narrower towards the crowns.

    face: as for `palate`.
    """
    ridge = Warp(as_field(0.0), as_field(0.0), -z, SHAPES["dental arch"])
    taper = smooth_max(2.0, (-4.0 - z) * 0.09, 0.0)
    bone = smooth_max(3.0, ridge + taper, z - 1.0, -20.0 - z)
    return smooth_max(1.0, bone, 3.0 - face)


def upper_teeth(parameters: PhantomParameters) -> Field:
    """Build crowns and roots; those under the two sinuses differ."""

    def root(a: float, b: float, c: float) -> Field:
        return Chain(((a, b, c), (0.94 * a + 0.5, b - 1.2, -19)), (1.1, 2.2))

    crowns = [
        Chain(((0.94 * a + 0.5, b - 1.2, -19), (0.94 * a + 0.5, b - 1.5, -24)), (r, r))
        for a, b, r in _CROWNS
    ]
    roots = [root(*apex) for apex in ((4, -5, -8), (9.5, -7, -6), (15, -12, -7))]
    for side, sign in ((Side.RIGHT, 1.0), (Side.LEFT, -1.0)):
        molars = [root(*apex) for apex in molar_roots(parameters, side)]
        roots.append(one_side(smooth_min(0.0, *molars), sign))
    return smooth_min(0.0, *crowns, *roots)


def mandible() -> Field:
    """Build the lower jaw of one side: branch with its two heads, body, arch."""
    condyle, coronoid = SHAPES["condyle"], SHAPES["coronoid"]
    branch = smooth_min(2.0, smooth_max(3.0, ramus(), z - 12.0), condyle, coronoid)
    return smooth_min(4.0, branch, SHAPES["jaw body"], SHAPES["jaw arch"])


def lower_teeth() -> Field:
    """Build the crowns and roots of the lower teeth, below the upper ones."""
    teeth = [
        Chain(((a, b, -26.5), (a, b, -38)), (r, 0.4 * r))
        for a, b, r in (
            (3.2, -7, 2.8),
            (9.0, -9, 2.8),
            (14.5, -13.5, 3.2),
            (18.5, -20, 3.8),
            (21.5, -28, 4.2),
            (23.5, -37, 4.2),
        )
    ]
    return smooth_max(0.5, smooth_min(0.0, *teeth), z + 24.4)
