import numpy as np
import pytest

from renderers.fsr.sparse_rows import SparseRows


def test_voxels_and_centres_follow_the_rows() -> None:
    matrix = np.diag([0.5, 2.0, 3.0, 1.0])
    matrix[:3, 3] = (10.0, 20.0, 30.0)
    offsets = np.array([0, 2, 2, 3, 3, 3, 4])
    rows = SparseRows((2, 3, 5), matrix, offsets, np.array([1, 4, 0, 3], np.uint16))
    wanted = [[1, 0, 0], [4, 0, 0], [0, 2, 0], [3, 2, 1]]
    np.testing.assert_array_equal(rows.voxels(), wanted)
    np.testing.assert_allclose(
        rows.centers_mm(), np.array(wanted) * [0.5, 2, 3] + [10, 20, 30]
    )
    assert rows.row_count == 3


def test_offsets_must_fit() -> None:
    with pytest.raises(ValueError, match="do not fit"):
        SparseRows((1, 2, 3), np.eye(4), np.array([0, 1, 2]), np.zeros(3, np.uint16))


@pytest.mark.parametrize("axis", range(3))
def test_a_grid_is_no_longer_than_small_numbers_count(axis: int) -> None:
    nz, ny, nx = (65537 if k == axis else 1 for k in range(3))
    with pytest.raises(ValueError, match="65536 voxels along an axis"):
        SparseRows(
            (nz, ny, nx), np.eye(4), np.zeros(65538, np.int64), np.zeros(0, np.uint16)
        )
