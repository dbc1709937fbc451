"""The ethmoid cells of one side, before and behind the basal lamella."""

from dataclasses import dataclass

import numpy as np

from anatomy.phantom.parameters import PhantomParameters
from anatomy.phantom.shapes import (
    Cells,
    Chain,
    Field,
    Point,
    Table,
    U,
    Unevenness,
    depth_table,
    height_table,
    smooth_max,
    smooth_min,
    u,
    y,
    z,
)
from anatomy.phantom.vessels import ethmoidal_arteries
from anatomy.tissue import Side

BULLA: Point = (9.8, -28.2, 30.0)
POSTERIOR_ROOT: Point = (9.0, -41.0, 33.5)
FOVEA_BONE_MM = 0.5
SEED_DEPTH_MM = 1.3
"""Least depth of a cell's seed in the block."""
MEDIAL_MM = 5.5
"""Lateral distance that a wider or narrower ethmoid keeps."""


@dataclass(frozen=True, slots=True)
class Ethmoid:
    """Hold the ethmoid's two groups of cells and the seeds they were grown from."""

    anterior: Field
    posterior: Field
    anterior_seeds: tuple[Point, ...]
    posterior_seeds: tuple[Point, ...]


def ethmoid_roof(parameters: PhantomParameters) -> Field:
    """Return the height of the fovea ethmoidalis over the depth."""
    rise = parameters.roof_mm
    return depth_table([15, 40, 56], [52.5 + rise, 49.1 + 0.8 * rise, 47.0])


def fovea(parameters: PhantomParameters) -> Field:
    """Return the roof's height; it falls towards the olfactory fossa."""
    return ethmoid_roof(parameters) + Table(
        U, (4, 7, 11, 17), (-1.8, -0.4, 0.2, -0.6), 2.0
    )


def lamina_papyracea(parameters: PhantomParameters, side: Side) -> Field:
    """Return the lateral position of the middle of the orbit's medial wall."""
    scale = parameters.scale("ethmoid", side)
    width = np.array([12.7, 14.4, 15.5, 16.4, 16.7]) - MEDIAL_MM
    table = depth_table(
        [10, 20, 35, 50, 56], [float(v) for v in MEDIAL_MM + scale * width], 2.0
    )
    # The plate bulges a little towards the orbit at half height.
    return table + height_table([24, 36, 50], [-0.5, 0.4, -0.6], 4.0)


def basal_lamella() -> Field:
    """Return the depth y of the basal lamella over the height."""
    return height_table(
        [18, 22, 27, 33, 39, 45, 52], [-50, -47.8, -45.2, -40.6, -32.6, -34.4, -35.6]
    )


def medial_wall() -> Field:
    """Return the lateral position of the cells' inner wall over the height."""
    return height_table([22, 30, 45, 50], [6.9, 5.9, 5.0, 4.6])


def ethmoid_block(parameters: PhantomParameters, side: Side) -> Field:
    """Build the space of all ethmoid cells of one side, between its outer walls."""
    medial = medial_wall()
    bottom = depth_table(
        [15, 20, 26, 30, 34, 42, 46, 54], [38, 34, 26.2, 24.4, 24.4, 25.2, 27, 28.4]
    )
    face = parameters.mucosa_mm + parameters.cell_bone_mm / 2
    lateral = lamina_papyracea(parameters, side) - face
    roof = fovea(parameters) - (parameters.mucosa_mm + FOVEA_BONE_MM)
    block = smooth_max(
        1.6,
        smooth_max(1.6, medial - u, u - lateral),
        smooth_max(1.6, bottom - z, z - roof),
    )
    front = height_table([30, 38, 44, 52], [-20, -19.5, -17.5, -15.5])
    block = smooth_max(1.6, block, smooth_max(1.2, y - front, -52.6 - y))
    # The roof of the middle meatus is wavy: the cells keep off it.
    gap = height_table([27, 31], [3.4, 1.2], 2.0)
    block = smooth_max(1.2, block, (lateral_wall() + gap - u) * 0.55)
    if parameters.has("hanging-artery", side):
        mesentery = parameters.mucosa_mm + 0.3
        artery = ethmoidal_arteries(parameters, side)
        block = smooth_max(0.6, block, mesentery - artery)
    return block


def ethmoid(parameters: PhantomParameters, side: Side) -> Ethmoid:
    """Build the ethmoid cells: Voronoi cells before and behind the basal lamella.

    Each group drains along the minimum spanning tree of its seeds, which leads to the
    bulla in front and to the cell at the superior meatus behind.
    """
    rng = np.random.default_rng([parameters.seed, int(side)])
    block = ethmoid_block(parameters, side)
    lamella = basal_lamella()
    half = parameters.cell_bone_mm / 2 + parameters.mucosa_mm
    wide = (parameters.scale("ethmoid", side) - 1.0) * 8.0
    groups = []
    for fore, count, root, low, high in (
        (
            True,
            parameters.anterior_cells,
            BULLA,
            (6.5, -30, 27),
            (12.5 + wide, -19, 49),
        ),
        (
            False,
            parameters.posterior_cells,
            POSTERIOR_ROOT,
            (7, -50, 29),
            (14 + wide, -33, 46),
        ),
    ):
        cut = (lamella + half - y) if fore else (y - lamella + half)
        region = smooth_max(0.8, block, cut * 0.8)
        seeds = _draw_seeds(rng, region, count, root, np.array(low), np.array(high))
        cells: Field = Cells(region, seeds, half, 1.0)
        tubes: list[Field] = [
            Chain((seeds[i], seeds[j]), (1.1, 1.1)) for i, j in _spanning_tree(seeds)
        ]
        tree = smooth_max(0.3, smooth_min(0.0, *tubes), region)
        groups.append((smooth_min(0.5, cells, tree) + Unevenness(0, 0.25), seeds))
    (fore_cells, fore_seeds), (rear_cells, rear_seeds) = groups
    return Ethmoid(fore_cells, rear_cells, fore_seeds, rear_seeds)


def _draw_seeds(
    rng: np.random.Generator,
    region: Field,
    count: int,
    root: Point,
    low: np.ndarray,
    high: np.ndarray,
) -> tuple[Point, ...]:
    """Draw cell seeds 40 times and keep the draw with the widest spacing.

    Seeds lie well inside the region: the tubes that join them must not leave it.
    """
    drawn = rng.uniform(low, high, (60 * count, 3))
    drawn = drawn[region.evaluate(drawn.T) < -SEED_DEPTH_MM]
    best, kept = -1.0, np.empty((0, 3))
    for _ in range(40):
        seeds = drawn[rng.choice(len(drawn), count, replace=False)]
        seeds[0] = root
        # Cells are narrow from side to side, so a lateral step counts for more.
        d = np.linalg.norm((seeds[:, None] - seeds[None]) * (1.4, 1, 1), axis=2)
        least = float((d + 1e3 * np.eye(count)).min())
        if least > best:
            best, kept = least, seeds
    return tuple((float(s[0]), float(s[1]), float(s[2])) for s in kept)


def _spanning_tree(seeds: tuple[Point, ...]) -> list[tuple[int, int]]:
    """Find the minimum spanning tree from seed 0 (Prim)."""
    points = np.array(seeds)
    distance = np.linalg.norm(points[:, None] - points[None], axis=2)
    joined, edges = [0], []
    while len(joined) < len(seeds):
        rest = [j for j in range(len(seeds)) if j not in joined]
        _, i, j = min((distance[i, j], i, j) for i in joined for j in rest)
        edges.append((i, j))
        joined.append(j)
    return edges


def bulla_outlet() -> Field:
    """Build the bulla's outlet to the middle meatus."""
    return Chain((BULLA, (8.3, -31.0, 23.5)), (1.2, 1.2))


def posterior_outlet() -> Field:
    """Build the posterior cells' outlet to the superior meatus."""
    return Chain(((6.2, -42, 33.5), POSTERIOR_ROOT), (1.2, 1.2))


def lateral_wall() -> Field:
    """Return the lateral position of the nasal cavity's side wall over the height.

    It steps inwards where the ethmoid begins: the roof of the middle meatus.
    """
    return height_table(
        [-20, 2, 8, 20, 25, 29, 60], [11.5, 12.6, 13.2, 13.0, 10.9, 4.3, 3.3], 1.0
    )
