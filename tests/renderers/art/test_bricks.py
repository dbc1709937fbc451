import math

import numpy as np

from renderers.art.bricks import Bricks
from renderers.art.cells import CellGrid, cube_distances

SHAPE = (17, 25, 18)
GRID = CellGrid(SHAPE)
VALUES = np.random.default_rng(0).normal(size=SHAPE).astype(np.float32)


def make_bricks(slots: int) -> Bricks:
    leap = cube_distances(VALUES, np.zeros((0, 2), np.float32))
    return Bricks(GRID, np.ones(3), leap, np.zeros(slots, np.int64))


def test_a_brick_shows_the_cells_own_values() -> None:
    bricks = make_bricks(5)
    n = GRID.side + 1
    for slot, cell in enumerate((7, 0, 3)):
        bricks.show(cell, slot, GRID.block(VALUES, cell))
        z, y, x = GRID.start(cell)
        inside = VALUES[z : z + n, y : y + n, x : x + n]
        brick = bricks.view.samples.reshape(-1, n, n, n, 4)[slot]
        k, j, i = inside.shape
        assert np.array_equal(brick[:k, :j, :i, 0], inside)
        assert bricks.shows(cell)
        assert bricks.view.slots[cell] == slot
    bricks.hide(7)
    assert not bricks.shows(7)


def test_bricks_are_made_as_slots_are_filled() -> None:
    bricks = make_bricks(1000)
    fixed = math.prod(n - 1 for n in SHAPE) + 3
    brick = (GRID.side + 1) ** 3 * 16
    assert bricks.bytes == fixed
    bricks.show(0, 0, GRID.block(VALUES, 0))
    assert bricks.bytes == fixed + 64 * brick
    bricks.show(1, 64, GRID.block(VALUES, 1))
    assert bricks.bytes == fixed + 128 * brick
    bricks.show(2, 999, GRID.block(VALUES, 2))
    assert bricks.bytes == fixed + 1000 * brick
