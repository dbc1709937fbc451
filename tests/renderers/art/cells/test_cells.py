from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_array_equal
from scipy import ndimage

from renderers.art.cells.cells import (
    CellGrid,
    CellShare,
    cube_distances,
    follow_distances,
)
from renderers.art.crew import Crew
from renderers.scene import Volume
from renderers.scene.thread_pool import ThreadPool

shapes = st.tuples(*[st.integers(2, 40)] * 3)
sides = st.sampled_from([8, 16, 32])


def random_values(shape: tuple[int, int, int]) -> np.ndarray:
    return np.random.default_rng(sum(shape)).integers(-1000, 3000, shape, np.int16)


@given(shape=shapes, side=sides)
def test_every_cube_belongs_to_one_cell(shape: tuple[int, int, int], side: int) -> None:
    grid = CellGrid(shape, side)
    owners = np.zeros([n - 1 for n in shape], int)
    for cell in range(grid.cells):
        z, y, x = grid.start(cell)
        owners[z : z + side, y : y + side, x : x + side] += 1
    assert np.all(owners == 1)


@settings(max_examples=20)
@given(
    shape=st.tuples(*[st.integers(2, 23)] * 3),
    seed=st.integers(0, 99),
    threshold=st.floats(-2, 4),
)
def test_cubes_know_how_far_the_next_visible_one_is(
    shape: tuple[int, int, int], seed: int, threshold: float
) -> None:
    values = np.random.default_rng(seed).normal(size=shape)
    clear = np.array([[-np.inf, threshold]], np.float32)
    found = cube_distances(values, clear)
    high = values
    for axis in range(3):
        n = shape[axis]
        high = np.maximum(
            np.take(high, range(n - 1), axis), np.take(high, range(1, n), axis)
        )
    assert len(found) == high.size + 3
    full = np.argwhere(high > threshold)
    for index, distance in zip(np.ndindex(high.shape), found, strict=False):
        gap = np.abs(full - index).max(axis=1).min() if len(full) else 255
        assert distance == gap or abs(high - threshold).min() < 1e-4
    # A cell that nobody can see into holds no cube that somebody would fetch.
    grid = CellGrid(shape)
    occupied = grid.occupied(grid.value_ranges(values), clear)
    for z, y, x in np.argwhere(found[:-3].reshape(high.shape) == 0):
        cell = (z // 8 * grid.counts[1] + y // 8) * grid.counts[2] + x // 8
        assert occupied[cell]


@pytest.mark.parametrize(("layers", "few"), [(300, 3), (97, 1), (97, 40), (49, 2)])
def test_slabs_that_are_looked_at_one_by_one_make_one_field(
    layers: int, few: int
) -> None:
    """What is next may lie several slabs away, farther than a byte counts."""
    values = np.zeros((layers, 14, 19), np.float32)
    drawn = np.random.default_rng(few)
    values[tuple(drawn.integers(0, n, few) for n in values.shape)] = 1.0
    clear, pool = np.array([[-1.0, 0.5]], np.float32), ThreadPool(3)
    found = cube_distances(values, clear, Crew(pool.map))
    seen = ndimage.maximum_filter(values, 2, origin=-1)[:-1, :-1, :-1] > 0.5
    plain = ndimage.distance_transform_cdt(~seen, "chessboard")
    assert_array_equal(found[:-3].reshape(seen.shape), np.minimum(plain, 255))


def test_without_clear_values_everything_may_be_seen() -> None:
    nothing = np.zeros((0, 2), np.float32)
    assert not cube_distances(np.zeros((4, 5, 6), np.int16), nothing).any()
    grid = CellGrid((20, 20, 20))
    assert grid.occupied(np.zeros((grid.cells, 2), np.float32), nothing).all()


@pytest.mark.parametrize("shape", [(20, 18, 33), (9, 17, 10), (8, 25, 16)])
def test_the_cells_an_edit_touches_are_those_whose_blocks_differ(
    shape: tuple[int, int, int],
) -> None:
    rng = np.random.default_rng(sum(shape))
    grid, values = CellGrid(shape), random_values(shape)
    for _ in range(60):
        edited = values.copy()
        at = tuple(int(rng.integers(n)) for n in shape)
        edited[at] += 1
        expected = [
            cell
            for cell in range(grid.cells)
            if not np.array_equal(grid.block(values, cell), grid.block(edited, cell))
        ]
        assert grid.touched(np.array(at), np.array(at)).tolist() == expected
        other = np.array([int(rng.integers(n)) for n in shape])
        low, high = np.minimum(at, other), np.maximum(at, other)
        edited[tuple(slice(a, b + 1) for a, b in zip(low, high, strict=True))] += 1
        expected = [
            cell
            for cell in range(grid.cells)
            if not np.array_equal(grid.block(values, cell), grid.block(edited, cell))
        ]
        assert grid.touched(low, high).tolist() == expected


@pytest.mark.parametrize("kind", ["i1", "<i2", ">u2", "<f4", ">f8"])
def test_a_block_of_an_edited_array_is_refused(kind: str) -> None:
    """Whichever voxel of it, ghosts too; what lies beyond it does not matter."""
    rng = np.random.default_rng(8)
    values = random_values((20, 18, 33)).astype(kind)
    volume = Volume(values, np.ones(3), np.zeros(3))
    grid = CellGrid(volume.shape)
    share = CellShare(grid, volume.values, None)
    for _ in range(60):
        at = tuple(int(rng.integers(n)) for n in values.shape)
        before = values[at]
        values[at] = before - 1 if before > 0 else before + 1
        touched = grid.touched(np.array(at), np.array(at))
        for cell in range(grid.cells):
            if cell in touched:
                with pytest.raises(ValueError, match=f"cell {cell} is another now"):
                    share.block(cell)
            else:
                share.block(cell)
        values[at] = before
        assert np.array_equal(share.block(3), grid.block(values, 3))


def test_an_array_that_nobody_can_edit_is_not_summed(tmp_path: Path) -> None:
    values = random_values((20, 18, 33))
    np.save(tmp_path / "v.npy", values)
    mapped = np.load(tmp_path / "v.npy", mmap_mode="r", allow_pickle=False)
    values.flags.writeable = False
    for kept in (mapped, values):
        share = CellShare(CellGrid(kept.shape), kept, None)
        assert share._sums is None
    wide = np.zeros((20, 18, 33))
    part = Volume(wide[2:], np.ones(3), np.zeros(3)).values
    assert CellShare(CellGrid((18, 18, 33)), part, None)._sums is not None


def test_mistakes_are_named() -> None:
    with pytest.raises(ValueError, match="cell side must be one of"):
        CellGrid((9, 9, 9), 12)
    with pytest.raises(ValueError, match="at least 2 voxels"):
        CellGrid((9, 1, 9))
    with pytest.raises(ValueError, match="there is no cell 8"):
        CellGrid((9, 9, 9)).start(8)
    with pytest.raises(ValueError, match="do not fit the grid"):
        CellShare(CellGrid((9, 9, 9)), np.zeros((9, 9, 8)), None)


@given(st.integers(0, 2**32), st.sampled_from([0.02, 0.3, 0.9]))
def test_distances_that_follow_an_edit_are_those_found_afresh(
    seed: int, share: float
) -> None:
    """Something appears, vanishes or both, near to faces too."""
    rng = np.random.default_rng(seed)
    shape = tuple(rng.integers(2, 24, 3).tolist())
    clear = np.array([[-np.inf, 0.5]], np.float32)
    values = (rng.random(shape) < share).astype(np.float32)
    leap = cube_distances(values, clear)
    for _ in range(4):
        ends = np.sort(rng.integers(0, shape, (2, 3)), axis=0)
        box = tuple(slice(a, b + 1) for a, b in ends.T)
        values[box] = rng.random(values[box].shape) < rng.choice([0.0, share, 1.0])
        before = leap.copy()
        met = follow_distances(leap, values, clear, *ends)
        assert_array_equal(leap, cube_distances(values, clear))
        changed = np.argwhere((leap != before)[:-3].reshape([n - 1 for n in shape]))
        if met is None:
            assert not len(changed)
        elif len(changed):
            assert np.all(changed >= met[0])
            assert np.all(changed <= met[1])
