"""The scenes: rooms and tubes that a straight scope can practise in.

Each is drawn anew for a seed, until the thickest scope reaches all of it without a
touch: it only turns about its pivot, and moves along itself. All are entered at the
front, along +y. Of two seeds 2n and 2n + 1, the second is the first in a mirror.
"""

import difflib
import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from anatomy.abstract.boxes import Box, BoxSpace
from anatomy.abstract.layout import PAST_MM, WIRE_MM, Doubles, Hoop, Layout
from anatomy.abstract.signs import HALF_MM, LETTERS, Sign
from anatomy.abstract.space import AbstractSpace, build_space
from anatomy.abstract.tubes import TubeSpace, chain
from system import UserError

Draw = np.random.Generator

TRIES = 4000
"""Layouts that are drawn for a seed, at most; most take less than a hundred."""

MOUTH_MM = 5.0
"""Half the width of the hole that a scope enters by."""
FRONT_MM = 4.0
"""Thickness of the wall around it."""
AROUND_MM = 4.0
"""Solid that is built around a space."""

_PIVOT = np.array([0.0, -FRONT_MM / 2, 0.0])

_MOUTH: Box = ((-MOUTH_MM, MOUTH_MM), (-np.inf, 0.0), (-MOUTH_MM, MOUTH_MM))

HOOP_MM, GATE_MM = 4.0, 5.5
"""Radii of hoops in a room, and of those in a tube."""

TUBE_MM = 8.0
"""Radius of the tube: about what a nasal passage is high and wide together."""

APART_MM = 1.0
"""Air around a hoop's wire, at least."""

RAISED_MM = 1.0
"""A raised sign stands so far out of its wall."""

NICHE_MM = 5.5
"""Half a niche's length along its passage, and its depth: its bottom's middle is in
sight from 45 degrees beside the passage, where a straight scope's picture of 40 has
ended."""

FAINT = 0.35
"""Paint of bands that only show how far it is."""

_SIDES = np.array(
    [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]]
)
"""Inward normals of the walls beside a scope."""


def _hoops(draw: Draw) -> Layout:
    """Hang hoops in a room, each facing the mouth, the next one always aside."""
    half_x, half_z, deep = 24.0, 22.0, 64.0
    room: Box = ((-half_x, half_x), (0.0, deep), (-half_z, half_z))
    depths = np.linspace(18.0, 54.0, 6) + draw.uniform(-1.5, 1.5, 6)
    turns = np.radians(draw.uniform(0, 360) + np.cumsum(draw.uniform(70, 200, 6)))
    reach = HOOP_MM + WIRE_MM + 2.0
    hoops = []
    for depth, turn in zip(depths, turns, strict=True):
        share = draw.uniform(0.6, 1.0) * min(depth / 28.0, 1.0)
        x = share * (half_x - reach) * math.cos(turn)
        z = share * (half_z - reach) * math.sin(turn)
        middle = np.array([x, depth, z])
        hoops.append(Hoop(middle, _unit(middle - _PIVOT), HOOP_MM))
    return Layout(
        BoxSpace.of([room, _MOUTH]),
        *_around(room),
        _PIVOT,
        {f"hoop {n}": hoop.middle for n, hoop in enumerate(hoops, start=1)},
        tuple(hoops),
        stripes=_floor(-half_z),
    )


def _path(draw: Draw) -> Layout:
    """Wind a tube through which a straight scope just fits, with hoops on its way."""
    straight_mm, towards = 14.0, draw.uniform(0, 360)
    pieces = [(straight_mm, math.inf, 0.0)]
    for length_mm, side in ((7.0, 0), (14.0, 180), (14.0, 0), (14.0, 180)):
        bend_mm = draw.uniform(26.0, 40.0)
        pieces.append((length_mm, bend_mm, towards + side + draw.uniform(-35, 35)))
    tube = TubeSpace(chain((0.0, 4.0 - straight_mm, 0.0), pieces), TUBE_MM)
    hoops = [Hoop(*tube.at(way), GATE_MM) for way in np.arange(22.0, 62.0, 8.0)]
    end, _ = tube.at(tube.length_mm)
    landmarks = {f"waypoint {n}": hoop.middle for n, hoop in enumerate(hoops, start=1)}
    wide = TUBE_MM + 5.0
    return Layout(
        tube,
        *_around(((-wide, wide), (0.0, float(end[1]) + TUBE_MM), (-wide, wide))),
        _PIVOT,
        landmarks | {"end": end},
        tuple(hoops),
        stripes=_bands(tube),
    )


def _targets(draw: Draw) -> Layout:
    """Put raised signs on the walls of a room: four behind, one on each side."""
    half_x, half_z, deep = 20.0, 17.0, 44.0
    room: Box = ((-half_x, half_x), (0.0, deep), (-half_z, half_z))
    signs = []
    for letter, n in zip(LETTERS, draw.permutation(8), strict=True):
        a, b = draw.uniform(-1.5, 1.5, 2)
        if n < 4:
            side_x, side_z = (-1, 1)[n % 2], (-1, 1)[n // 2]
            place = np.array([side_x * (11.5 + a), deep, side_z * (8.5 + b)])
            normal = np.array([0.0, -1.0, 0.0])
        else:
            normal = _SIDES[n - 4]
            place = -normal * (half_x, 0.0, half_z)
            place[1] = 33.0 + a
            place += 3.0 * b * np.abs(np.cross(normal, (0.0, 1.0, 0.0)))
        signs.append(_sign(letter, place + RAISED_MM * normal, normal))
    blocks = [_block(sign) for sign in signs]
    return Layout(
        BoxSpace.of([room, _MOUTH], blocks),
        *_around(room),
        _PIVOT,
        _named(signs),
        signs=tuple(signs),
        stripes=_floor(-half_z),
    )


def _niches(draw: Draw) -> Layout:
    """Cut niches into the sides of a passage, signs at their bottoms."""
    half, deep, last = 6.0, NICHE_MM, 64.0
    passage: Box = ((-half, half), (0.0, last), (-half, half))
    rooms, signs, side = [passage], [], -1
    for letter, middle in zip(LETTERS, np.arange(24.0, 57.0, 8.0), strict=False):
        # two beside each other are never on one side
        side = int(draw.choice([n for n in range(4) if n != side]))
        normal = _SIDES[side]
        place = np.array([0.0, middle + draw.uniform(-0.5, 0.5), 0.0])
        place -= (half + deep) * normal
        signs.append(_sign(letter, place, normal))
        ranges = []
        for axis, (at, towards) in enumerate(zip(place, normal, strict=True)):
            # the niche begins at the passage's middle, so that they are one
            ends = sorted((at, at + (half + deep) * towards))
            if towards == 0.0:
                wide = NICHE_MM if axis == 1 else HALF_MM + 0.5
                ends = [at - wide, at + wide]
            ranges.append((float(ends[0]), float(ends[1])))
        rooms.append((ranges[0], ranges[1], ranges[2]))
    wide = half + deep
    return Layout(
        BoxSpace.of([*rooms, _MOUTH]),
        *_around(((-wide, wide), (0.0, last), (-wide, wide))),
        _PIVOT,
        _named(signs),
        signs=tuple(signs),
        stripes=_floor(-half),
    )


SCENES: dict[str, Callable[[Draw], Layout]] = {
    "hoops": _hoops,
    "niches": _niches,
    "path": _path,
    "targets": _targets,
}
"""What draws a scene, by its name."""


def build_scene(name: str, seed: int = 1, spacing_mm: float = 0.5) -> AbstractSpace:
    """Build a scene on a grid of cubic voxels.

    The same arguments give the same bits. UserError for a name that there is not, a
    negative seed, or a spacing outside [0.2, 1] mm.
    """
    if name not in SCENES:
        near = difflib.get_close_matches(name, SCENES, 1, 0.0)[0]
        raise UserError(
            f"There is no scene {name!r}; did you mean {near!r}? There are: "
            f"{', '.join(SCENES)}."
        )
    if seed < 0:
        raise UserError(f"the seed of a scene must not be negative, got {seed}")
    return build_space(draw_layout(name, seed // 2), spacing_mm, (1.0, -1.0)[seed % 2])


def draw_layout(name: str, number: int) -> Layout:
    """Return the layout of a scene, the same for the same number.

    UserError where the number's draws leave no way for a scope.
    """
    draw = np.random.default_rng([number, *name.encode()])
    for _ in range(TRIES):
        layout = SCENES[name](draw)
        ways = [(hoop.middle, PAST_MM) for hoop in layout.hoops]
        if all(layout.is_open_to(place, past) for place, past in ways) and _apart(
            layout
        ):
            return layout
    raise UserError(
        f"No layout of the scene {name!r} was found for the seeds {2 * number} and "
        f"{2 * number + 1}; take another seed."
    )


def _apart(layout: Layout) -> bool:
    """Return whether no hoop comes near a wall or another hoop."""
    for n, hoop in enumerate(layout.hoops):
        across = np.cross(hoop.axis, (0.0, 0.0, 1.0))
        across /= np.linalg.norm(across)
        other = np.cross(hoop.axis, across)
        turn = np.linspace(0, 2 * np.pi, 36, endpoint=False)[:, None]
        ring = np.cos(turn) * across + np.sin(turn) * other
        ring = hoop.middle + hoop.radius_mm * ring
        others = replace(layout, hoops=layout.hoops[:n] + layout.hoops[n + 1 :])
        if others.distance_mm(*ring.T).max() > -WIRE_MM - APART_MM:
            return False
    return True


def _sign(letter: str, middle: Doubles, normal: Doubles) -> Sign:
    """Hang a sign so that it is upright for a scope that looks in along +y."""
    view = _unit(np.array([0.0, 0.3, 0.0]) - normal)
    right = _unit(np.cross(view, (0.0, 0.0, 1.0)))
    return Sign(letter, middle, normal, np.cross(normal, right))


def _block(sign: Sign) -> Box:
    """Return the block whose face a raised sign is painted on."""
    low = sign.middle - HALF_MM * (1.0 - np.abs(sign.normal))
    high = sign.middle + HALF_MM * (1.0 - np.abs(sign.normal))
    # one side is the wall's own plane: nothing of it is left over
    behind = sign.middle - RAISED_MM * sign.normal
    low, high = np.minimum(low, behind), np.maximum(high, behind)
    x, y, z = zip(low.tolist(), high.tolist(), strict=True)
    return x, y, z


def _named(signs: list[Sign]) -> dict[str, Doubles]:
    return {f"target {sign.letter}": sign.middle for sign in signs}


def _floor(low_z: float) -> Callable[[Doubles], Doubles]:
    """Paint a line along the middle of the floor: it shows what is down."""

    def stripes(places: Doubles) -> Doubles:
        x, _, z = places.T
        share: Doubles = np.clip(1.7 - np.abs(x), 0.0, 1.0) * (z < low_z + 1.5)
        return share

    return stripes


def _bands(tube: TubeSpace) -> Callable[[Doubles], Doubles]:
    """Paint faint bands about a tube, a line along its floor, a ring at its end."""
    end, along = tube.at(tube.length_mm)

    def stripes(places: Doubles) -> Doubles:
        middle, way = tube.nearest(places)
        apart = np.abs((way + 4.0) % 8.0 - 4.0)
        share = FAINT * np.clip(1.1 - apart, 0.0, 1.0)
        away = places - middle
        below = np.hypot(away[:, 0], away[:, 1])
        line = np.clip(1.7 - below, 0.0, 1.0) * (away[:, 2] < 0.0)
        share = np.maximum(share, line)
        beyond = places - end
        ahead = beyond @ along
        aside = np.linalg.norm(beyond - ahead[:, None] * along, axis=1)
        to_ring = np.minimum(aside - 1.2, np.abs(aside - 3.6) - 0.6)
        ring = np.clip(0.5 - to_ring, 0.0, 1.0)
        painted: Doubles = np.where(ahead > 0.0, ring, share)
        return painted

    return stripes


def _around(box: Box) -> tuple[Doubles, Doubles]:
    """Return the corners of what is built around a box; its front is open."""
    low, high = np.array(box).T
    low = low - AROUND_MM
    low[1] = -FRONT_MM
    return low, high + AROUND_MM


def _unit(way: Doubles) -> Doubles:
    unit: Doubles = way / np.linalg.norm(way)
    return unit
