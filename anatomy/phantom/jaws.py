"""Palate, tooth-bearing bone and teeth of the upper jaw; the lower jaw."""

from anatomy.phantom.cheek import ramus
from anatomy.phantom.fixed_shapes import SHAPES
from anatomy.phantom.maxillary import molar_roots
from anatomy.phantom.parameters import PhantomParameters
from anatomy.phantom.shapes import (
    Chain,
    Field,
    Table,
    U,
    as_field,
    depth_table,
    smooth_max,
    smooth_min,
    u,
    y,
    z,
)
from anatomy.phantom.warp import Warp, one_side
from anatomy.tissue import Side

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
