import math

import numpy as np
import pytest

from renderers.art.cells.bricks import Bricks
from renderers.art.cells.cells import SIDES, CellGrid, cube_distances
from renderers.art.crew import ALONE, Crew
from renderers.scene.thread_pool import ThreadPool

SHAPE = (17, 25, 18)
GRID = CellGrid(SHAPE)
VALUES = np.random.default_rng(0).normal(size=SHAPE).astype(np.float32)


def make_bricks(slots: int) -> Bricks:
    leap = cube_distances(VALUES, np.zeros((0, 2), np.float32))
    return Bricks(GRID, np.ones(3), leap, np.zeros(slots, np.int64))


def test_bricks_are_made_as_slots_are_filled() -> None:
    bricks = make_bricks(1000)
    fixed = math.prod(n - 1 for n in SHAPE) + 3
    brick = (GRID.side + 1) ** 3 * 16
    assert bricks.bytes == fixed
    for count, slot in enumerate((0, 64, 999), 1):
        bricks.show(count, slot, GRID.block(VALUES, count))
        assert bricks.bytes == fixed + count * brick
    bricks.hide(1)
    assert bricks.bytes == fixed + 2 * brick


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("kind", ["float32", "int16", "float64", "uint8", ">i2", "f2"])
@pytest.mark.parametrize("gradients", [False, True])
def test_bricks_made_together_are_those_made_one_by_one(
    side: int, kind: str, gradients: bool
) -> None:
    """To the bit, cells at the volume's faces included, whoever makes which."""
    values = np.random.default_rng(2).integers(0, 200, (40, 25, 37)).astype(kind)
    grid, pool = CellGrid(values.shape, side), ThreadPool(2)
    span = 200.0 if np.dtype(kind).kind == "i" else None
    leap, stamp = np.zeros(8, np.uint8), np.zeros(grid.cells, np.int64)
    spacing = np.array([0.4, 0.5, 1.0])
    one, all_ = (
        Bricks(grid, spacing, leap, stamp, span, gradients=gradients, crew=crew)
        for crew in (ALONE, Crew(pool.map))
    )
    slots = np.random.default_rng(3).permutation(grid.cells)
    for cell, slot in enumerate(slots.tolist()):
        one.show(cell, slot, grid.block(values, cell))
    all_.show_all(np.arange(grid.cells), slots, values)
    assert np.array_equal(one.view.samples, all_.view.samples)
    assert np.array_equal(one.view.corners, all_.view.corners)
    assert np.array_equal(one.view.slots, all_.view.slots)


def test_whole_numbers_take_half_the_memory() -> None:
    """Values keep their bits, gradients 1/32767 of the steepest there can be."""
    values = np.random.default_rng(1).integers(-1024, 3072, SHAPE).astype(np.int16)
    spacing, n = np.array([0.4, 0.5, 1.0]), GRID.side + 1
    span = float(np.ptp(values))
    leap, stamp = np.zeros(8, np.uint8), np.zeros(1, np.int64)
    plain = Bricks(GRID, spacing, leap, stamp)
    compact = Bricks(GRID, spacing, leap, stamp, span)
    for cell in range(GRID.cells):
        for bricks in (plain, compact):
            bricks.show(cell, 0, GRID.block(values, cell))
        assert compact.view.samples.nbytes * 2 == plain.view.samples.nbytes
        a = plain.view.samples.reshape(n, n, n, 4)
        b = compact.view.samples.reshape(n, n, n, 4).astype(np.float64)
        assert np.array_equal(a[..., 0], b[..., 0])
        unit = span / spacing.min() / 32767
        found = b[..., 1:] * compact.view.gradient_unit * 32767
        assert np.abs(found - a[..., 1:]).max() < 0.501 * unit
        assert np.abs(b).max() <= 32767


def test_bricks_of_values_alone_take_a_quarter() -> None:
    leap, stamp = np.zeros(8, np.uint8), np.zeros(1, np.int64)
    full = Bricks(GRID, np.ones(3), leap, stamp)
    alone = Bricks(GRID, np.ones(3), leap, stamp, gradients=False)
    for bricks in (full, alone):
        bricks.show(3, 0, GRID.block(VALUES, 3))
    assert alone.view.samples.nbytes * 4 == full.view.samples.nbytes
    assert np.array_equal(alone.view.samples, full.view.samples[::4])


def test_a_volume_too_large_to_be_numbered_stays_in_cells() -> None:
    vast = np.broadcast_to(np.int16(7), (1024, 1024, 1024))
    leap, stamp = np.zeros(8, np.uint8), np.zeros(1, np.int64)
    assert not Bricks(GRID, np.ones(3), leap, stamp, 1.0, whole=vast).view.whole.size


@pytest.mark.parametrize("slot", [-1, 5, 1 << 40])
def test_a_slot_that_the_cache_has_not_is_refused(slot: int) -> None:
    bricks = make_bricks(5)
    with pytest.raises(IndexError, match=f"slot {slot} is none of the 5"):
        bricks.show(0, slot, GRID.block(VALUES, 0))
    assert not bricks.shows(0)
