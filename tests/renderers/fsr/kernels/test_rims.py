"""Packets of rays find what rays find one by one."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from renderers.fsr.kernels import rims
from renderers.fsr.surfels.rim_sharpening import SPARE
from renderers.scene import Camera
from tests.renderers.fsr import plain_rims


def view_of(width: int, height: int) -> NDArray[np.float32]:
    """Give the rays of a wide lens that looks along y."""
    camera = Camera.looking_at((0, 0, 0), (0, 1, 0), extent=1.1, size=(width, height))
    return camera.lens_table()


@settings(deadline=None, max_examples=40)
@given(
    seed=st.integers(0, 2**32 - 1),
    height=st.integers(3, 30),
    width=st.integers(3, 40),
    wide=st.floats(0.002, 3),
    air=st.floats(-2, 1),
)
def test_packets_find_what_single_rays_find_in_any_field(
    seed: int, height: int, width: int, wide: float, air: float
) -> None:
    """Rays that creep, leave the grid, start in tissue or never arrive included."""
    random = np.random.default_rng(seed)
    distance = (wide * random.standard_normal((14, 19, 23)) + air).astype(np.float32)
    depth = random.uniform(0, 6, (height, width)).astype(np.float32)
    depth[random.random(depth.shape) < 0.1] = np.inf
    eye = random.uniform(4, 12, 3).astype(np.float32)
    axes, lens = np.eye(3, dtype=np.float32), view_of(width, height)
    queue = np.empty(depth.size + SPARE, np.int32)
    found = np.zeros((depth.size + 1, 4), np.float32)
    done, moved = rims.sharpen(
        distance, 2 * axes, eye, axes, lens, depth, 0, height, queue,
        np.zeros(depth.size, np.uint8), found,
    )  # fmt: skip
    asked, wanted = plain_rims.sharpen(distance, 2 * axes, eye, axes, lens, depth)
    assert done == asked
    assert set(queue[:moved].tolist()) == set(wanted)
    for at, t in wanted.items():
        assert found[at, 0] == t
        np.testing.assert_allclose(np.linalg.norm(found[at, 1:]), 1, atol=1e-5)


@pytest.mark.parametrize(("height", "width"), [(5, 5), (7, 18), (33, 35), (64, 49)])
def test_rims_are_where_a_neighbour_is_much_deeper(height: int, width: int) -> None:
    random = np.random.default_rng(height)
    depth = random.uniform(3, 4, (height, width)).astype(np.float32)
    depth[random.random(depth.shape) < 0.2] = np.inf
    found = np.full(depth.size + SPARE, -1, np.int32)
    n = rims.list_rims(depth, 1, height, found)
    assert 0 < n < depth.size
    assert found[:n].tolist() == plain_rims.list_rims(depth, 1, height)
