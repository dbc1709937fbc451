"""Holes are filled where neighbours agree that there is a wall."""

import copy

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_array_equal
from numpy.typing import NDArray

from renderers.fsr.kernels.surfel_tiles import TILE_HEIGHT, TILE_WIDTH
from renderers.fsr.surfels.hole_filling import fill_holes
from renderers.scene import GBuffer
from renderers.scene.thread_pool import ThreadPool

ONE_TILE = [(0, 0)]


def wall(height: int, width: int) -> tuple[NDArray[np.float32], GBuffer]:
    """Give rays and a wall that faces the eye at 4 mm."""
    rays = np.ones((height, width, 3), np.float32)
    result = GBuffer.empty(height, width)
    result.depth_mm[:] = 4
    result.normal[..., 2] = 1
    result.coverage[:] = 1
    return rays, result


def test_holes_take_the_mean_of_their_neighbours_and_open_air_stays_open() -> None:
    rays, result = wall(6, 7)
    result.depth_mm[:, 3] = np.arange(6)
    for y, x in ((2, 2), (4, 5), (4, 6)):
        result.coverage[y, x] = 0
        result.depth_mm[y, x] = np.inf
    rays[4, 5] = 0  # outside the lens: not a hole
    assert fill_holes(rays, result, ONE_TILE, ThreadPool(1)) == 1
    assert result.depth_mm[2, 2] == (5 * 4.0 + 1 + 2 + 3) / 8
    assert_array_equal(result.normal[2, 2], [0, 0, 1])
    assert np.isinf(result.depth_mm[4, 5])
    assert np.isinf(result.depth_mm[4, 6])


@settings(max_examples=20)
@given(seed=st.integers(0, 2**32 - 1))
def test_tiles_and_threads_do_not_show(seed: int) -> None:
    random = np.random.default_rng(seed)
    height, width = 2 * TILE_HEIGHT + 9, TILE_WIDTH + 30
    rays, torn = wall(height, width)
    torn.depth_mm[:] = random.uniform(1, 9, (height, width))
    torn.coverage[:] = random.random((height, width)) > 0.2
    tiles = [(row, column) for row in range(3) for column in range(2)]
    # the means by whole arrays, of what was there before
    covered = torn.coverage > 0
    ways = [(b, a) for b in (-1, 0, 1) for a in (-1, 0, 1)]
    around = np.stack([np.roll(covered, way, (0, 1)) for way in ways])
    depths = np.stack(
        [np.roll(np.where(covered, torn.depth_mm, 0), way, (0, 1)) for way in ways]
    )
    is_hole = ~covered & (around.sum(axis=0) >= 5)
    is_hole[[0, -1]] = is_hole[:, [0, -1]] = False
    mean = depths.sum(axis=0, dtype=float) / np.maximum(around.sum(axis=0), 1)
    filled = []
    for order, threads in ((tiles, 1), (tiles[::-1], 3)):
        result = copy.deepcopy(torn)
        assert fill_holes(rays, result, order, ThreadPool(threads)) == is_hole.sum() > 0
        filled.append(result)
    a, b = filled
    assert_array_equal(a.depth_mm, b.depth_mm)
    assert_array_equal(a.normal, b.normal)
    assert_array_equal(a.coverage, covered | is_hole)
    np.testing.assert_allclose(a.depth_mm[is_hole], mean[is_hole], rtol=1e-6)
    assert_array_equal(a.depth_mm[~is_hole], torn.depth_mm[~is_hole])
