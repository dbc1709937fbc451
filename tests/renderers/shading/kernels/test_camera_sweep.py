import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numba import njit
from numpy.testing import assert_array_equal
from numpy.typing import NDArray

from renderers.lanes import load, store
from renderers.shading.kernels.camera_sweep import (
    W,
    add_bloom,
    copy_row,
    defocus_weights,
    write_row,
)

f32 = np.float32
Floats = NDArray[np.float32]


@njit(error_model="numpy")
def weights(depth: Floats, tone: Floats, result: Floats) -> None:
    near, middle, far = defocus_weights(load(depth, 0, W), tone)
    store(result, 0, near)
    store(result, W, middle)
    store(result, 2 * W, far)


@given(focus=st.floats(2, 50), strength=st.floats(0.1, 5))
def test_defocus_shares_light_between_the_pictures(
    focus: float, strength: float
) -> None:
    soft, softer = 0.8, 1.8
    tone = np.array([6 / focus, strength, soft, softer], np.float32)
    depth = np.geomspace(0.01, 100, W).astype(np.float32)
    depth[3], depth[5] = np.inf, focus
    got = np.empty((3, W), np.float32)
    weights(depth, tone, got)
    np.testing.assert_allclose(got.sum(axis=0), 1, atol=1e-6)
    assert got.min() > -1e-6
    assert_array_equal(got[:, 5], [1, 0, 0])
    out_of = np.abs(6 / np.maximum(depth.astype(float), 0.05) - 6 / focus)
    radius = strength * np.maximum(out_of - 0.12, 0)
    # the blend's mean width is the radius, as long as a picture is soft enough
    width = got[1] * soft + got[2] * softer
    np.testing.assert_allclose(width, np.minimum(radius, softer), atol=2e-5 * strength)


def test_bloom_is_added_between_its_rows() -> None:
    rng = np.random.default_rng(0)
    exposed, glow = rng.random((2, 3, 4 * W)).astype(np.float32)
    got = np.zeros((3, 4 * W), np.float32)
    add_bloom(exposed, 4 * W, glow, 0, 8 * W, f32(0.25), got, 8 * W, 4 * W)
    expected = exposed[1] + 0.75 * glow[0] + 0.25 * glow[2]
    np.testing.assert_allclose(got[2], expected, rtol=1e-6)
    assert not got[:2].any()
    copy_row(exposed, 4 * W, got, 0, 4 * W)
    assert_array_equal(got[0], exposed[1])


@pytest.mark.parametrize(("first", "last"), [(0, 64), (20, 50), (7, 57)])
def test_planes_of_codes_become_pixels_in_a_black_row(first: int, last: int) -> None:
    codes = np.random.default_rng(1).integers(1, 256, (3, 100), dtype=np.uint8)
    picture = np.full((2, 57, 3), 9, np.uint8)
    write_row(codes, 30, first, last, picture, 1)
    expected = codes[:, 30:87].T.copy()
    expected[:first] = 0
    expected[last:] = 0
    assert_array_equal(picture[1], expected)
    assert np.all(picture[0] == 9)
