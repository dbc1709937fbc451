"""Tools near the lens blur, nothing else does, and an even light stays even."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from numpy.typing import NDArray

from renderers.scene import GBuffer, Material
from renderers.scene.gbuffer import TOOLS
from renderers.shading.bands import RowBands
from renderers.shading.camera.near_tools import NearTools
from renderers.shading.kernels.blur_near import METAL, PLASTIC, SHARP_MM

SIZE = (300, 400)


def half_hidden(tool_mm: float, material: Material = Material.METAL) -> GBuffer:
    """Tissue at 12 mm, the right half hidden by something nearer."""
    buffer = GBuffer.empty(*SIZE)
    buffer.depth_mm[:], buffer.coverage[:] = 12.0, 1.0
    buffer.depth_mm[:, 200:], buffer.material[:, 200:] = tool_mm, material
    return buffer


def edge() -> NDArray[np.float32]:
    """Dark tissue on the left, a bright tool on the right."""
    radiance = np.full((*SIZE, 3), 0.1, np.float32)
    radiance[:, 200:] = 0.9
    return radiance


@pytest.mark.parametrize(
    ("tool_mm", "material"),
    [(SHARP_MM, Material.METAL), (40.0, Material.METAL), (1.0, Material.TISSUE)],
)
def test_what_is_no_near_tool_costs_nothing_and_changes_no_bit(
    tool_mm: float, material: Material
) -> None:
    assert [int(each) for each in TOOLS] == [METAL, PLASTIC]
    radiance = edge()
    look = NearTools(RowBands(1)).look
    assert look(radiance, half_hidden(tool_mm, material)) is radiance


def test_the_nearer_a_tool_the_softer_its_edge() -> None:
    width = []
    for tool_mm in (6.0, 4.5, 3.5, 2.0):
        row = NearTools(RowBands(1)).look(edge(), half_hidden(tool_mm))[150, :, 0]
        assert np.all(np.diff(row) > -1e-6), "no fringe"
        assert_allclose(row[[100, 300]], [0.1, 0.9], atol=1e-6)
        # the sigma of a Gaussian that blurs an edge so
        share = (row.astype(float) - 0.1) / 0.8
        width.append(float((share * (1 - share)).sum()) * math.sqrt(math.pi))
    assert width == sorted(width)
    assert width[0] < 2 < 8 < width[-1]


@given(st.integers(0, 2**32 - 1), st.sampled_from((1, 2, 3)))
def test_an_even_light_stays_even_and_threads_change_nothing(
    seed: int, threads: int
) -> None:
    rng = np.random.default_rng(seed)
    buffer = GBuffer.empty(*SIZE)
    buffer.depth_mm[:] = rng.uniform(0.5, 9.0, SIZE)
    buffer.material[:] = rng.integers(0, 4, SIZE)
    even = np.full((*SIZE, 3), 0.4, np.float32)
    assert_allclose(NearTools(RowBands(1)).look(even, buffer), 0.4, atol=1e-5)
    light = rng.random((*SIZE, 3)).astype(np.float32)
    one = NearTools(RowBands(1)).look(light, buffer)
    used = NearTools(RowBands(threads))
    used.look(even, buffer)
    assert_array_equal(used.look(light, buffer), one)
    assert one.min() >= -1e-6


def test_tissue_far_from_the_tool_keeps_its_light() -> None:
    light = np.random.default_rng(2).random((*SIZE, 3)).astype(np.float32)
    seen = NearTools(RowBands(1)).look(light, half_hidden(1.0))
    assert_array_equal(seen[:, :140], light[:, :140])
