"""The orbit: its walls, fat, globe, muscles and optic nerve."""

from collections.abc import Callable
from typing import TypeVar

from anatomy.phantom.ethmoid import lamina_papyracea
from anatomy.phantom.head import head_outside
from anatomy.phantom.parameters import PhantomParameters
from anatomy.phantom.program import Row
from anatomy.phantom.shapes import (
    Chain,
    Ellipsoid,
    Field,
    Point,
    Recall,
    smooth_max,
    smooth_min,
    u,
    y,
)
from anatomy.phantom.vessels import optic_nerve
from anatomy.phantom.warp import one_side
from anatomy.tissue import Label, Side

GLOBE: Point = (31.0, -10.0, 38.0)
GLOBE_RADIUS_MM = 12.0
APEX: Point = (16.5, -51.0, 42.0)
_S = TypeVar("_S")


def cone() -> Field:
    """Build the space inside the periorbita, without its medial wall."""
    return Chain(((31, -11, 38), (27, -24, 38.6), APEX), (17.6, 14.5, 2.5))


def orbit(parameters: PhantomParameters, side: Side, skin: Field) -> Field:
    """Build the orbit of one side; the lamina papyracea bounds it medially.

    skin: the distance from the face, which bounds it in front.
    """
    wall = lamina_papyracea(parameters, side) + parameters.cell_bone_mm / 2
    return smooth_max(1.0, cone(), smooth_max(1.0, wall - u, 3.0 - skin * 1.6))


def muscles() -> Field:
    """Build the four straight muscles and the superior oblique."""
    x, front, top = GLOBE
    bellies = [
        Chain(((19.6, -12, 38), (18.6, -28, 39), (16.5, -47, 41.5)), (1.0, 2.0, 1.0)),
        Chain(((x - 1, -12, 25.7), (26, -28, 28.5), (17.5, -47, 40)), (1.0, 2.1, 1.0)),
        Chain(((x - 1, -12, 50.6), (26, -28, 48.6), (17.5, -47, 43.5)), (1.0, 2.0, 1)),
        Chain(((43.2, -14, 38), (36, -30, 39), (18, -47, 41.5)), (1.0, 2.0, 1.0)),
        Chain(((22, -6, 49), (19.5, -26, 47), (17, -47, 43.5)), (0.9, 1.4, 0.8)),
    ]
    gland = Ellipsoid((x + 9, front + 3, top + 10), (4.0, 6.0, 2.5))
    return smooth_min(0.0, *bellies, gland)


def solids(parameters: PhantomParameters, paint: Callable[..., _S]) -> list[_S]:
    """List the orbit's solids; `paint` makes them (`surroundings.Solid`)."""
    found: list[_S] = []
    skin = Recall(Row.FACE, head_outside())
    for side, sign in ((Side.RIGHT, 1.0), (Side.LEFT, -1.0)):
        inside = one_side(orbit(parameters, side, skin), sign)
        # Beside the ethmoid the cells' own shell is the wall: no other bone there.
        beside = smooth_min(0.0, lamina_papyracea(parameters, side) - u + 3.0, -19 - y)
        shell = smooth_max(0.0, inside, beside)
        found.append(
            paint(shell, "bone", Label.THICK_BONE, level_mm=1.3, steepness=2.4)
        )
        found.append(paint(inside, "fat", Label.FAT, steepness=2.4))
    globe = Ellipsoid(GLOBE, (GLOBE_RADIUS_MM,) * 3)
    lens = Ellipsoid((GLOBE[0], GLOBE[1] + 8.0, GLOBE[2]), (4.5, 2.0, 4.5))
    found += [
        paint(globe, "muscle", Label.GLOBE),
        paint(globe, "vitreous", Label.GLOBE, level_mm=-0.9),
        paint(lens, "lens", Label.LENS),
        paint(muscles(), "muscle", Label.EXTRAOCULAR_MUSCLE),
        paint(optic_nerve(), "csf", Label.OPTIC_NERVE),
        paint(optic_nerve(), "optic nerve", Label.OPTIC_NERVE, level_mm=-0.7),
    ]
    return found
