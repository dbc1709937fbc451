"""The ethmoid cells of one side, and the arteries in their roof."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from anatomy.phantom.fixed_shapes import course, middle_of
from anatomy.phantom.parameters import PhantomParameters
from anatomy.phantom.shapes import (
    Affine,
    Cells,
    Chain,
    Field,
    Point,
    Signed,
    Table,
    U,
    Unevenness,
    Warp,
    Y,
    Z,
    depth_table,
    height_table,
    smooth_max,
    smooth_min,
    u,
    y,
    z,
)
from anatomy.tissue import Side

BULLA = middle_of("bulla outlet")
BULLA_REACH_MM = 2.6
"""The bulla is the largest cell of the anterior group."""
RETROBULBAR = middle_of("retrobulbar outlet")
POSTERIOR_ROOT = course("posterior outlet").points[-1]
REACHES_MM = -1.3, 1.1
"""Range of the other cells' reaches: what makes them uneven in size."""
CORNER_MM = 1.6
"""Width over which the walls of a cell blend into each other."""
CLEAR_MM = 5.5
"""No cell is drawn nearer to the place of a named one that the side lacks."""
SPARE_MM = 0.04
"""What a wall between cells is thicker on either side than its layers: unevenness and
the rims of ostia take from it."""
BEND_MM = 0.9
"""How far walls between cells are bent out of their course."""
FOVEA_BONE_MM = 0.5
SEED_DEPTH_MM = 1.5
"""Least depth of a cell's seed in the block."""
TUBE_MM = 1.2
"""Radius of the ways between cells, before their walls round it off."""
DETOUR = 20.0
"""Length that a way between cells may gain for each length it comes nearer to a wall
than `SEED_DEPTH_MM`."""
BULGE_MM = 0.8
"""How far a cell bulges into the orbit, or stays behind, beyond the plate's course."""
RECESS_MM = 1.1
"""How far a cell stays behind the inner wall's plane, beyond the taper, at most."""
MEDIAL_MM = 5.5
"""Lateral distance that a wider or narrower ethmoid keeps."""


@dataclass(frozen=True, slots=True)
class Ethmoid:
    """The ethmoid's two groups of cells and the seeds they were grown from."""

    anterior: Field
    posterior: Field
    anterior_seeds: tuple[Point, ...]
    posterior_seeds: tuple[Point, ...]


def ethmoid_roof(parameters: PhantomParameters) -> Field:
    """Return the height of the fovea ethmoidalis over the depth."""
    rise = parameters.roof_mm
    return depth_table([15, 40, 56], [52.5 + rise, 49.1 + 0.8 * rise, 47.0])


def by_side(right: float, left: float) -> Field:
    """Return one number on the right and one on the left, joined at the midline."""
    if right == left:
        return Affine(right)
    step = smooth_min(0.0, smooth_max(0.0, Signed(), -1.0), 1.0)
    return (right + left) / 2 + step * Affine((right - left) / 2)


def keros_depth(parameters: PhantomParameters) -> Field:
    """Return the depth of the olfactory fossa of either side, by the signed u."""
    return by_side(parameters.keros(Side.RIGHT), parameters.keros(Side.LEFT))


def fovea(parameters: PhantomParameters) -> Field:
    """Return the roof's height; it falls towards the olfactory fossa."""
    return ethmoid_roof(parameters) + Table(
        U, (4, 7, 11, 17), (-1.8, -0.4, 0.2, -0.6), 2.0
    )


def lamina_papyracea(parameters: PhantomParameters, side: Side) -> Field:
    """Return the lateral position of the middle of the orbit's medial wall."""
    rng = np.random.default_rng([parameters.seed, int(side), 0x6C70])
    scale = parameters.scale("ethmoid", side)
    depths = [10, 16, 22, 28, 34, 40, 46, 52, 57]
    width = np.array([11.6, 13.1, 14.5, 15.6, 16.4, 16.9, 17.1, 16.9, 16.3])
    width = MEDIAL_MM + scale * (width - MEDIAL_MM)
    # Cells bulge into the orbit, one more than the next.
    width += rng.uniform(-0.45, 0.45, len(depths))
    table = depth_table(depths, [float(v) for v in width], 2.5)
    # One cell bulges higher up than the next; under the roof none does.
    rng = np.random.default_rng([parameters.seed, int(side), 0x6275])
    swing = depth_table([16, 23, 30, 37, 44, 51], _alternating(rng, 6, BULGE_MM), 2.5)
    heights = [*_alternating(rng, 3, 1.0), 0.0]
    bulge = swing * height_table([25, 32.5, 40, 46.5], heights, 2.5)
    # The plate bulges towards the orbit at half height; above, the labyrinth tapers.
    return table + bulge + height_table([23, 34, 43, 51], [-0.8, 0.5, 0.3, -1.1], 4.0)


def _alternating(rng: np.random.Generator, count: int, most: float) -> list[float]:
    """Draw values of 0.4 to 1 times `most`, of alternating sign."""
    signs = rng.choice((-1.0, 1.0)) * (-1.0) ** np.arange(count)
    return [float(v) for v in most * signs * rng.uniform(0.4, 1.0, count)]


def basal_lamella(parameters: PhantomParameters, side: Side) -> Field:
    """Return the depth y of the basal lamella: over the height, and bulging sideways.

    Cells in front and behind indent it; how far is drawn for each side.
    """
    rng = np.random.default_rng([parameters.seed, int(side), 0x626C])
    medial, lateral = rng.uniform(0.4, 1.3, 2)
    shift = float(np.clip(rng.normal(0.1, 0.2), -0.5, 0.6))
    course = height_table(
        [18, 22, 27, 33, 39, 45, 52], [-50, -48.1, -45.6, -40.9, -32.6, -34.6, -36.0]
    )
    knots = (shift + float(medial), shift, shift - float(lateral), shift + 0.6)
    return course + Table(U, (5.0, 8.0, 11.5, 15.0), knots, 1.5)


def medial_wall() -> Field:
    """Return the lateral position of the cells' inner wall over the height."""
    return height_table([22, 30, 45, 50], [6.9, 5.9, 5.0, 4.6])


def _recess(parameters: PhantomParameters, side: Side) -> Field:
    """Return how far the cells stay behind the inner wall's plane, 0 at the roof.

    The labyrinth is narrow in front, and one cell comes nearer to the nose than the
    next: how near is drawn for each side.
    """
    rng = np.random.default_rng([parameters.seed, int(side), 0x6D77])
    drawn = rng.uniform(0.0, RECESS_MM, 6)
    taper = np.array([1.8, 1.4, 0.2, 0.0, 0.0, 0.3])
    course = depth_table([18, 24, 30, 37, 44, 51], (taper + drawn).tolist(), 2.5)
    return course * height_table([25, 29, 40, 45], [0.3, 1.0, 1.0, 0.0], 2.0)


def ethmoid_block(parameters: PhantomParameters, side: Side) -> Field:
    """Build the space of all ethmoid cells of one side, between its outer walls."""
    medial = medial_wall() + _recess(parameters, side)
    # The floor climbs towards the orbit, and less towards the nose.
    bottom = depth_table(
        [15, 20, 26, 30, 34, 42, 46, 54], [38, 34, 26.2, 24.4, 24.4, 25.2, 27, 28.4]
    ) + Table(U, (5.5, 8.5, 12.0, 16.5), (0.8, 0.0, 0.0, 2.2), 2.5)
    face = parameters.mucosa_mm + parameters.cell_bone_mm / 2
    lateral = lamina_papyracea(parameters, side) - face
    roof = fovea(parameters) - (parameters.mucosa_mm + FOVEA_BONE_MM)
    block = smooth_max(
        1.6,
        smooth_max(1.6, medial - u, u - lateral),
        z - roof,
    )
    # Below, no wall meets the next one in a corner.
    block = smooth_max(3.0, block, bottom - z)
    front = height_table(
        [26, 30, 34, 38, 44, 52], [-26.5, -25.5, -23.8, -20.2, -15.6, -14.6], 2.0
    )
    # The cells reach farthest back halfway between nose and orbit.
    rear = Table(U, (5.0, 9.5, 13.0, 17.0), (1.2, 0.0, 0.0, 2.0), 2.5) - 52.5
    block = smooth_max(2.2, block, smooth_max(1.2, y - front, rear - y))
    # The roof of the middle meatus is wavy: the cells keep off it.
    gap = height_table([27, 31], [3.4, 1.2], 2.0)
    block = smooth_max(1.2, block, (lateral_wall() + gap - u) * 0.55)
    if parameters.has("hanging-artery", side):
        mesentery = parameters.mucosa_mm + 0.3
        artery = ethmoidal_arteries(parameters, side)
        block = smooth_max(0.6, block, mesentery - artery)
    return block


def suprabullar(parameters: PhantomParameters) -> Point:
    """Return the middle of the cell between the bulla and the skull base."""
    return 9.2, -26.3, 43.6 + 0.8 * parameters.roof_mm


def ethmoid(parameters: PhantomParameters, side: Side) -> Ethmoid:
    """Build the ethmoid cells before and behind the basal lamella.

    Each group drains along the minimum spanning tree of its seeds, which leads to the
    bulla in front and to the cell at the superior meatus behind. What divides the
    cells is bent at random, differently on either side.
    """
    rng = np.random.default_rng([parameters.seed, int(side)])
    block = ethmoid_block(parameters, side)
    lamella = basal_lamella(parameters, side)
    half = parameters.cell_bone_mm / 2 + parameters.mucosa_mm + SPARE_MM
    wide = (parameters.scale("ethmoid", side) - 1.0) * 8.0
    fore = smooth_max(0.8, block, (lamella + half - y) * 0.8)
    rear = smooth_max(0.8, block, (y - lamella + half) * 0.8)
    named, lacking = [(BULLA, BULLA_REACH_MM)], []
    for variant, place in (
        ("suprabullar-cell", suprabullar(parameters)),
        ("retrobulbar-recess", RETROBULBAR),
    ):
        if parameters.has(variant, side):
            named.append((place, 0.0))
        else:
            lacking.append(place)
    low, high = np.array((6.5, -33, 27)), np.array((12.5 + wide, -18, 49))
    seeds = _draw_seeds(
        rng, _Drawing(fore, parameters.anterior_cells, named, lacking, low, high)
    )
    anterior = _group(rng, fore, seeds, half)
    low, high = np.array((7, -50, 29)), np.array((14 + wide, -33, 46))
    root = [(POSTERIOR_ROOT, 0.4)]
    rear_seeds = _draw_seeds(
        rng, _Drawing(rear, parameters.posterior_cells, root, [], low, high)
    )
    posterior = _group(rng, rear, rear_seeds, half)
    return Ethmoid(
        anterior,
        posterior,
        tuple(place for place, _ in seeds),
        tuple(place for place, _ in rear_seeds),
    )


Seed = tuple[Point, float]
"""The middle of a cell, and its reach."""


def _group(
    rng: np.random.Generator, region: Field, seeds: list[Seed], half_mm: float
) -> Field:
    """Divide a region into cells that are joined along their spanning tree."""
    places = tuple(place for place, _ in seeds)

    def bend(axis: int, first: float, last: float) -> Field:
        knots = np.arange(first, last + 1, 6.0)
        values = rng.uniform(-BEND_MM, BEND_MM, len(knots))
        return Table(axis, tuple(knots.tolist()), tuple(values.tolist()), 2.0)

    shifts = (
        bend(Z, 22, 52) + bend(Y, -52, -16),
        bend(Z, 22, 52) + bend(U, 2, 20),
        bend(Y, -52, -16),
    )
    # The seeds are moved with the bent space: a cell's middle stays where it was drawn.
    points = np.array(places).T
    moved = points + [shift.evaluate(points) for shift in shifts]
    bent = tuple((float(a), float(b), float(c)) for a, b, c in moved.T)
    reaches = tuple(reach for _, reach in seeds)
    cells: Field = Warp(*shifts, Cells(bent, reaches, half_mm, CORNER_MM))
    tubes: list[Field] = [
        Chain((places[i], places[j]), (TUBE_MM, TUBE_MM))
        for i, j in _spanning_tree(places, region)
    ]
    joined = smooth_min(0.3, cells, *tubes)
    return smooth_max(1.2, region, joined) + Unevenness(0, 0.25)


@dataclass(frozen=True, slots=True)
class _Drawing:
    """What cells are drawn from.

    count: of all cells, the named ones among them. lacking: places that stay empty.
    low, high: ``(3,)`` corners of the box of the places.
    """

    region: Field
    count: int
    named: list[Seed]
    lacking: list[Point]
    low: NDArray[np.float64]
    high: NDArray[np.float64]


def _draw_seeds(rng: np.random.Generator, of: _Drawing) -> list[Seed]:
    """Draw cells 40 times and keep the draw with the widest spacing.

    Seeds lie well inside the region: the tubes that join them must not leave it.
    """
    drawn = rng.uniform(of.low, of.high, (60 * of.count, 3))
    drawn = drawn[of.region.evaluate(drawn.T) < -SEED_DEPTH_MM]
    for place in of.lacking:
        drawn = drawn[np.linalg.norm(drawn - place, axis=1) > CLEAR_MM]
    fixed = np.array([place for place, _ in of.named])
    least, kept = -np.inf, (fixed, np.zeros(len(fixed)))
    rest = of.count - len(fixed)
    for _ in range(40):
        places = np.concatenate(
            [fixed, drawn[rng.choice(len(drawn), rest, replace=False)]]
        )
        reaches = np.concatenate(
            [[reach for _, reach in of.named], rng.uniform(*REACHES_MM, rest)]
        )
        # Cells are narrow from side to side, so a lateral step counts for more.
        d = np.linalg.norm((places[:, None] - places[None]) * (1.4, 1, 1), axis=2)
        d = d - np.abs(reaches[:, None] - reaches[None]) + 1e3 * np.eye(of.count)
        if d.min() > least:
            least, kept = float(d.min()), (places, reaches)
    return [
        ((float(a), float(b), float(c)), float(reach))
        for (a, b, c), reach in zip(*kept, strict=True)
    ]


def _spanning_tree(seeds: tuple[Point, ...], region: Field) -> list[tuple[int, int]]:
    """Find the minimum spanning tree from seed 0 (Prim); ways stay in the region."""
    points = np.array(seeds)
    distance = np.linalg.norm(points[:, None] - points[None], axis=2)
    along = np.linspace(0, 1, 9)[:, None, None, None]
    ways = points[:, None] * (1 - along) + points[None] * along
    depth = -region.evaluate(ways.reshape(-1, 3).T).reshape(ways.shape[:3]).min(axis=0)
    distance += DETOUR * np.maximum(SEED_DEPTH_MM - depth, 0)
    joined, edges = [0], []
    while len(joined) < len(seeds):
        rest = [j for j in range(len(seeds)) if j not in joined]
        _, i, j = min((distance[i, j], i, j) for i in joined for j in rest)
        edges.append((i, j))
        joined.append(j)
    return edges


def lateral_wall() -> Field:
    """Return the lateral position of the nasal cavity's side wall over the height.

    It steps inwards where the ethmoid begins: the roof of the middle meatus.
    """
    return height_table(
        [-20, 2, 8, 20, 25, 29, 60], [11.5, 12.6, 13.2, 13.0, 10.9, 4.3, 3.3], 1.0
    )


CANAL_WALL_MM = 0.25
"""Bone between a sinus and the nerve or artery behind it: at the carotid 0.25 ± 0.16
mm, at the optic canal 0.27 ± 0.15 (Andrianakis 2021, 200 sides)."""

ETHMOID_ROOF_MM = 51.6
"""Height of the fovea at the anterior ethmoidal artery."""


def ethmoidal_arteries(parameters: PhantomParameters, side: Side) -> Chain:
    """Build the anterior and posterior ethmoidal arteries.

    They cross the roof from the orbit to the olfactory fossa; one that hangs lies
    3 mm below the roof in a bony mesentery.
    """
    drop = 3.0 if parameters.has("hanging-artery", side) else 0.0
    top = ETHMOID_ROOF_MM + parameters.roof_mm
    front = ((16.5, -27, top - 1.5 - drop), (9, -24, top - 0.2 - drop))
    middle: tuple[Point, ...] = ((4.5, -22, top - 1.0),)
    # The way back lies inside the skull: the two arteries are one chain.
    rear = ((5, -30, top + 1.5), (4.5, -36, top - 1.6), (15.5, -38.6, top - 2.6))
    points = (*front, *middle, *rear)
    return Chain(points, (0.5,) * len(points))


def maxillary_canals() -> tuple[Chain, Chain]:
    """Build the maxillary nerve's canals: foramen rotundum, infraorbital canal."""
    nerve = course("maxillary nerve")
    return (
        Chain(nerve.points[:2], nerve.radii[:2]),
        Chain(nerve.points[4:6], nerve.radii[4:6]),
    )
