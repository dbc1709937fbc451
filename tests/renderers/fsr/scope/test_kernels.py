import numpy as np

from renderers.fsr.scope.kernels import fill_holes


def test_holes_take_the_mean_of_their_neighbours_and_open_air_stays_open() -> None:
    rays = np.ones((6, 7, 3), np.float32)
    depth = np.full((6, 7), 4.0, np.float32)
    normal = np.zeros((6, 7, 3), np.float32)
    normal[..., 2] = 1
    coverage = np.ones((6, 7), np.float32)
    depth[:, 3] = np.arange(6)
    for y, x in ((2, 2), (4, 5), (4, 6)):
        coverage[y, x] = 0
        depth[y, x] = np.inf
    rays[4, 5] = 0  # outside the lens: not a hole
    where, found = np.empty((9, 2), np.int32), np.empty((9, 4), np.float32)
    assert fill_holes(rays, depth, normal, coverage, 5, where, found) == 1
    assert depth[2, 2] == (5 * 4.0 + 1 + 2 + 3) / 8
    np.testing.assert_array_equal(normal[2, 2], [0, 0, 1])
    assert np.isinf(depth[4, 5])
    assert np.isinf(depth[4, 6])


def test_a_hole_with_few_neighbours_is_open_air() -> None:
    rays = np.ones((5, 5, 3), np.float32)
    depth = np.full((5, 5), np.inf, np.float32)
    normal = np.zeros((5, 5, 3), np.float32)
    coverage = np.zeros((5, 5), np.float32)
    depth[:, :2], coverage[:, :2], normal[:, :2, 0] = 1, 1, 1
    where, found = np.empty((9, 2), np.int32), np.empty((9, 4), np.float32)
    assert fill_holes(rays, depth, normal, coverage, 5, where, found) == 0
    assert coverage.sum() == 10
