"""Bone and brain of the head outside of a sinus scan: jaw, rear skull base, spine.

They close the head of a wide field of view; none reaches into the nose's own.
"""

from collections.abc import Callable
from typing import TypeVar

from anatomy.phantom.shapes import Chain, Ellipsoid, Field, smooth_max, smooth_min, z
from anatomy.tissue import Label

_S = TypeVar("_S")


def mandible() -> Field:
    """Build the lower jaw of one side: ramus, body and alveolar arch."""
    ramus = Chain(((47, -60, 24), (44, -64, -10), (42, -56, -30)), (3.6, 4.5, 5.0))
    body = Chain(
        ((42, -56, -30), (38, -40, -42), (25, -15, -50), (9, -7, -54), (0, -6, -55)),
        (5.0, 5.2, 5.2, 5.4, 5.8),
    )
    arch = Chain(
        ((42, -54, -27), (26, -32, -36), (20, -20, -38), (10, -9, -39), (0, -6, -39)),
        (3.8, 4.6, 4.4, 3.8, 3.6),
    )
    return smooth_min(5.0, ramus, body, arch)


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


def solids(paint: Callable[..., _S]) -> list[_S]:
    """List the solids, made by `paint` as `anatomy.phantom.surroundings.Solid`."""
    cerebellum = Ellipsoid((24, -126, 30), (36, 34, 26))
    stem = Chain(((0, -100, 40), (0, -104, 10), (0, -110, -125)), (12.0, 9.0, 5.0))
    hind = smooth_min(6.0, cerebellum, stem)
    occiput = smooth_max(4.0, cerebellum - 6.0, z - 47.0)
    petrous = Chain(((20, -86, 24), (44, -92, 26), (58, -98, 6)), (6.0, 9.0, 11.0))
    spine = Chain(((0, -96, -14), (0, -92, -60), (0, -96, -125)), (9.0, 9.5, 10.0))
    arches = Chain(((0, -118, -18), (0, -122, -60), (0, -126, -125)), (8.0, 8.0, 9.0))
    column = smooth_min(3.0, spine, arches)
    zygomatic = Chain(((56, -56, 25), (61, -72, 25), (60, -88, 24)), (2.2, 2.4, 4.0))
    return [
        paint(column, "cancellous bone", Label.THICK_BONE),
        paint(column, "bone", Label.THICK_BONE, 0.5, -0.5),
        paint(occiput, "bone", Label.THICK_BONE),
        paint(petrous, "bone", Label.THICK_BONE),
        paint(hind - 1.6, "csf", Label.CSF),
        paint(hind, "brain", Label.BRAIN),
        paint(mandible(), "cancellous bone", Label.THICK_BONE),
        paint(mandible(), "bone", Label.THICK_BONE, 0.7, -0.7),
        paint(lower_teeth(), "tooth", Label.TEETH),
        paint(zygomatic, "bone", Label.THICK_BONE),
    ]
