"""Normals turned to the world's axes, and coverage, against numpy."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from scipy.spatial.transform import Rotation

from renderers.art.kernels.unpack_surface import unpack_surface


@pytest.mark.parametrize("is_turned", [False, True])
@pytest.mark.parametrize("shape", [(1, 1), (5, 33), (0, 4)])
def test_values_are_taken_apart(shape: tuple[int, int], is_turned: bool) -> None:
    value = np.random.default_rng(1).normal(size=(*shape, 4)).astype(np.float32)
    axes = (
        Rotation.from_rotvec([0.3, 0.5, -0.7]).as_matrix() if is_turned else np.eye(3)
    )
    normal = np.full((*shape, 3), np.nan, np.float32)
    coverage = np.full(shape, np.nan, np.float32)
    unpack_surface(value, axes, is_turned, normal, coverage)
    assert_array_equal(coverage, value[..., 3])
    if is_turned:
        wanted = value[..., :3].astype(np.float64) @ axes.T
        np.testing.assert_allclose(normal, wanted, rtol=0, atol=3e-7)
    else:
        assert_array_equal(normal, value[..., :3])
