"""The paranasal sinuses of one side with their ostia and drainage paths."""

from dataclasses import dataclass

import numpy as np

from anatomy.honeycomb import Cells, Mark, Unevenness
from anatomy.nose import Row, ethmoid_roof
from anatomy.parameters import PhantomParameters
from anatomy.shapes import (
    Chain,
    Ellipsoid,
    Field,
    Point,
    depth_table,
    height_table,
    smooth_max,
    smooth_min,
    u,
    y,
    z,
)

SINUS_UNEVENNESS = 0.4
"""Share of the nose's unevenness on sinus walls: they are thin, and both their faces
move, so more of it would open holes towards the nose."""


@dataclass(frozen=True, slots=True)
class Ethmoid:
    """Hold the ethmoid's two groups of cells and the seeds they were grown from."""

    anterior: Field
    posterior: Field
    anterior_seeds: tuple[Point, ...]
    posterior_seeds: tuple[Point, ...]


BULLA: Point = (9.8, -28.2, 30.0)
POSTERIOR_ROOT: Point = (9.0, -41.0, 33.5)
OSTIUM_CENTERS: dict[str, Point] = {
    "maxillary": (13.0, -27.4, 23.2),
    "frontal": (8.0, -11.5, 54.5),
    "sphenoid": (3.6, -53.5, 34.5),
}


def maxillary(parameters: PhantomParameters) -> Field:
    """Build the maxillary sinus: six smoothly joined walls, scaled about its medial.

    Its front, rear and lower lateral walls turn with u, its roof is the orbit's floor.
    """
    scale = parameters.maxillary_scale
    medial, mid_y, mid_z = 14.6, -28.0, 25.0

    def scaled(axis: Field, center: float) -> Field:
        return (axis - center) * (1 / scale) + center

    su, sy, sz = scaled(u, medial), scaled(y, mid_y), scaled(z, mid_z)
    dome = (su - 15.0) * (su - 15.0) * 0.02
    body = smooth_max(5.0, medial - su, su - (medial + 23.5))
    height = smooth_max(4.0, -4.0 - sz, (sz - 26.8 + dome) * 0.85)
    body = smooth_max(4.5, body, height)
    front = (sy + 11.0 + (su - 20.0) * 0.62) * 0.85
    rear = -44.5 + (su - 20.0) * 0.30 - sy
    body = smooth_max(5.0, body, smooth_max(6.0, front, rear))
    taper = ((su - 20.0) * 0.62 + (4.0 - sz) * 0.55 - 9.5) * 0.9
    body = smooth_max(4.0, body, taper)
    return body * scale


def infundibulum() -> Field:
    """Build the ethmoid infundibulum, the gutter behind the uncinate process."""
    return Chain(
        (
            (8.6, -18.5, 38),
            (11.2, -18.5, 33.5),
            (11.5, -22.5, 27.3),
            (11.4, -27.5, 23.8),
        ),
        (1.5, 1.4, 1.4, 1.5),
    )


def maxillary_ostium() -> Field:
    """Build the natural ostium, lateral to the uncinate process."""
    return Chain(((11.4, -27.0, 24.0), (18.5, -28.5, 21.5)), (2.0, 2.2))


def hiatus() -> Field:
    """Build the hiatus semilunaris between infundibulum and middle meatus."""
    upper = Chain(
        ((11.4, -24.5, 26.2), (9, -27, 24.3), (7.9, -29, 23)), (1.3, 1.2, 1.5)
    )
    lower = Chain(
        ((11.4, -27.5, 23.8), (9.2, -30.5, 22), (8.4, -32, 21)), (1.4, 1.3, 1.6)
    )
    return smooth_min(0.8, upper, lower)


def frontal(parameters: PhantomParameters) -> Field | None:
    """Build the frontal sinus; aplasia gives none."""
    q = parameters.frontal_scale
    if q == 0:
        return None
    center = (1.2 + 10.2 * q, -5.0, 56.5 + 9.8 * q)
    body = Ellipsoid(center, (10.0 * q, 6.8 * q**0.5, 10.3 * q))
    return smooth_max(1.0, body, 0.8 - u)


def frontal_recess() -> Field:
    """Build the frontal recess with the ostium at its waist."""
    return Chain(
        (
            (8.2, -8.5, 59),
            (8.0, -11.5, 54.5),
            (7.8, -13.0, 48.5),
            (8.2, -15.5, 42.5),
            (8.6, -17.5, 38),
        ),
        (3.4, 2.4, 2.3, 2.0, 1.7),
    )


def agger_nasi() -> Field:
    """Build the agger nasi cell."""
    return Ellipsoid((8.4, -8.2, 38.5), (2.8, 3.6, 4.4))


def agger_outlet() -> Field:
    """Build the agger nasi cell's outlet to the frontal recess."""
    return Chain(((8.4, -9.5, 39.5), (8.3, -16, 41.5)), (0.9, 0.9))


def sphenoid(parameters: PhantomParameters) -> Field:
    """Build the sphenoid sinus, cut off at the midline septum."""
    w = parameters.sphenoid_scale
    body = Ellipsoid((9.2, -54.7 - 11.8 * w, 34.5), (9.0 * w**0.5, 11.8 * w, 10.6 * w))
    return smooth_max(0.8, body, 0.6 - u)


def sphenoid_ostium() -> Field:
    """Build the sphenoid ostium in the sphenoethmoidal recess."""
    return Chain(((3.6, -51.5, 34.5), (5.2, -58, 34.5)), (1.55, 1.55))


def lamina_papyracea() -> Field:
    """Give the lateral position of the orbit's medial wall."""
    return depth_table([10, 20, 35, 50, 56], [11.6, 13.2, 14.6, 15.8, 16.2])


def ethmoid(parameters: PhantomParameters, rng: np.random.Generator) -> Ethmoid:
    """Build the ethmoid cells: Voronoi cells before and behind the basal lamella.

    Each group drains along the minimum spanning tree of its seeds, which leads to the
    bulla in front and to the cell at the superior meatus behind.
    """
    roof = ethmoid_roof(parameters)
    medial = height_table([22, 30, 45, 50], [6.9, 5.9, 5.0, 4.6])
    bottom = depth_table([15, 20, 26, 30, 34, 54], [38, 34, 26.2, 24.4, 24.4, 27])
    lateral = lamina_papyracea() - (parameters.mucosa_mm + 0.1)
    block = smooth_max(
        1.2,
        smooth_max(1.2, medial - u, u - lateral),
        smooth_max(1.2, bottom - z, z - roof + 0.6),
    )
    front = height_table([30, 38, 44, 52], [-20, -19.5, -17.5, -15.5])
    block = smooth_max(1.2, block, smooth_max(1.2, y - front, -52.6 - y))
    lamella = height_table(
        [18, 22, 27, 32, 37, 44, 52], [-50, -46.5, -43, -38.2, -31.4, -30.8, -30.2]
    )
    half = parameters.cell_bone_mm / 2 + parameters.mucosa_mm
    groups = []
    for fore, count, root, low, high in (
        (True, parameters.anterior_cells, BULLA, (6.5, -30, 27), (12.5, -20, 49)),
        (
            False,
            parameters.posterior_cells,
            POSTERIOR_ROOT,
            (7, -50, 29),
            (14, -33, 46),
        ),
    ):
        seeds = _draw_seeds(rng, count, root, np.array(low), np.array(high))
        cut = (lamella + half - y) if fore else (y - lamella + half)
        region = smooth_max(0.6, block, cut * 0.8)
        cells: Field = Cells(region, seeds, half, 0.8)
        tubes: list[Field] = [
            Chain((seeds[i], seeds[j]), (1.1, 1.1)) for i, j in _spanning_tree(seeds)
        ]
        tree = smooth_max(0.3, smooth_min(0.0, *tubes), region)
        groups.append((smooth_min(0.5, cells, tree) + Unevenness(0, 0.25), seeds))
    (fore_cells, fore_seeds), (rear_cells, rear_seeds) = groups
    return Ethmoid(fore_cells, rear_cells, fore_seeds, rear_seeds)


def _draw_seeds(
    rng: np.random.Generator,
    count: int,
    root: Point,
    low: np.ndarray,
    high: np.ndarray,
) -> tuple[Point, ...]:
    """Draw cell seeds 40 times and keep the draw with the widest spacing."""
    best, kept = -1.0, np.empty((0, 3))
    for _ in range(40):
        seeds = rng.uniform(low, high, (count, 3))
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


def lining(body: Field) -> Field:
    """Mark a sinus and make its walls slightly uneven."""
    return Mark(Row.SINUS, body + Unevenness(0, SINUS_UNEVENNESS))
