"""Packets of rays find what rays find one by one."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_array_equal
from numpy.typing import NDArray

from renderers.fsr.kernels import rims as packets
from renderers.fsr.kernels import rims_scalar as one_by_one
from renderers.fsr.surfels import SurfelRasterizer
from renderers.fsr.surfels.rim_sharpening import SPARE
from renderers.fsr.surfels.surfel_kernel_set import scalar_kernels
from renderers.scene import Camera, Volume
from renderers.scene.thread_team import ThreadTeam

Found = tuple[int, NDArray[np.int32], NDArray[np.float32]]

EXTENT = 1.1


def asked(
    sharpen: Callable[..., tuple[int, int]],
    distance: NDArray[np.float32],
    depth: NDArray[np.float32],
    eye: NDArray[np.float32],
) -> Found:
    """Sharpen a whole picture; give how many were asked, which moved, and to where."""
    height, width = depth.shape
    axes = np.eye(3, dtype=np.float32)
    size = (width, height)
    camera = Camera.looking_at((0, 0, 0), (0, 1, 0), extent=EXTENT, size=size)
    queue = np.empty(depth.size + SPARE, np.int32)
    found = np.zeros((depth.size + 1, 4), np.float32)
    done, moved = sharpen(
        distance, 2 * axes, eye, axes, camera.lens_table(), depth, 0, height, queue,
        np.zeros(depth.size, np.uint8), found,
    )  # fmt: skip
    where = np.sort(queue[:moved])
    return done, where, found[where]


@settings(deadline=None, max_examples=60)
@given(
    seed=st.integers(0, 2**32 - 1),
    height=st.integers(3, 40),
    width=st.integers(3, 70),
    wide=st.floats(0.002, 3),
    air=st.floats(-2, 1),
)
def test_any_field_gives_the_same_bits(
    seed: int, height: int, width: int, wide: float, air: float
) -> None:
    """Rays that creep, leave the grid, start in tissue or never arrive included."""
    random = np.random.default_rng(seed)
    distance = (wide * random.standard_normal((14, 19, 23)) + air).astype(np.float32)
    depth = random.uniform(0, 6, (height, width)).astype(np.float32)
    depth[random.random(depth.shape) < 0.1] = np.inf
    eye = random.uniform(4, 12, 3).astype(np.float32)
    done, where, found = asked(packets.sharpen, distance, depth, eye)
    done_twin, where_twin, found_twin = asked(one_by_one.sharpen, distance, depth, eye)
    assert done == done_twin
    assert_array_equal(where, where_twin)
    assert_array_equal(found.view(np.int32), found_twin.view(np.int32))


@pytest.mark.parametrize(("height", "width"), [(5, 5), (7, 18), (33, 35), (64, 49)])
def test_the_same_rims_are_listed_in_the_same_order(height: int, width: int) -> None:
    random = np.random.default_rng(height)
    depth = random.uniform(3, 4, (height, width)).astype(np.float32)
    depth[random.random(depth.shape) < 0.2] = np.inf
    lists = []
    for kernels in (packets, one_by_one):
        found = np.full(depth.size + SPARE, -1, np.int32)
        n = kernels.list_rims(depth, 1, height, found)
        lists.append(found[:n])
    assert 0 < len(lists[0]) < depth.size
    assert_array_equal(lists[0], lists[1])


def test_a_splatted_picture_gets_the_same_rims(
    bars: Volume, camera: Camera, team: ThreadTeam, three: ThreadTeam
) -> None:
    pictures = []
    counts = []
    for kernels, threads in ((None, team), (None, three), (scalar_kernels(), three)):
        rasterizer = SurfelRasterizer(bars, kernels=kernels)
        pictures.append(rasterizer.draw(camera, threads))
        counts.append(rasterizer.counters)
    assert counts[0]["rim pixels moved"] > 100
    for other in pictures[1:]:
        assert_array_equal(other.depth_mm, pictures[0].depth_mm)
        assert_array_equal(other.normal, pictures[0].normal)
