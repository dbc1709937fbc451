"""Points that a part of a picture asks for, against their definition."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.testing import assert_array_equal
from numpy.typing import NDArray

from renderers.scene import AirSurface, Camera, GBuffer
from renderers.shading import ScopeLight, ScopeShader, Tier
from renderers.shading.lattice_points import asked_points, dilated, pixels_of
from tests.renderers.shading.steel import tool

LIGHT = ScopeLight()

MASKS = arrays(
    np.bool_,
    st.tuples(st.integers(1, 21), st.integers(1, 21)),
    elements=st.sampled_from([False, False, False, True]),
)


@given(MASKS, st.sampled_from([4, 8]))
def test_every_pixel_asks_for_its_four_corners(
    only: NDArray[np.bool_], stride: int
) -> None:
    height, width = only.shape
    expected = np.zeros((height // stride + 2, width // stride + 2), np.bool_)
    for y, x in zip(*np.nonzero(only), strict=True):
        j, i = y // stride, x // stride
        expected[j : j + 2, i : i + 2] = True
    assert_array_equal(asked_points(only, only.shape, stride), expected)
    assert asked_points(None, only.shape, stride).all()
    assert asked_points(None, only.shape, stride).shape == expected.shape
    pixels = pixels_of(expected, stride, only.shape)
    wanted = {
        (min(j * stride, height - 1), min(i * stride, width - 1))
        for j, i in zip(*np.nonzero(expected), strict=True)
    }
    assert set(zip(*np.nonzero(pixels), strict=True)) == wanted


@given(MASKS, st.integers(0, 6))
def test_dilation_reaches_as_far_as_it_says(
    points: NDArray[np.bool_], reach: int
) -> None:
    expected = np.zeros_like(points)
    for j, i in zip(*np.nonzero(points), strict=True):
        square = slice(max(j - reach, 0), j + reach + 1)
        expected[square, max(i - reach, 0) : i + reach + 1] = True
    assert_array_equal(dilated(points, reach), expected)


@pytest.mark.parametrize("tier", [Tier.LIVE, Tier.SNAPSHOT])
@pytest.mark.parametrize("with_tool", [False, True])
def test_a_part_is_lit_by_the_points_it_asks_for_alone(
    surface: AirSurface,
    camera: Camera,
    tissue_gbuffer: GBuffer,
    tier: Tier,
    with_tool: bool,
) -> None:
    """To the bits of the whole picture, part by part, and nothing else is looked at."""
    seen, caster = tool(camera, tissue_gbuffer)
    if not with_tool:
        seen = tissue_gbuffer
    shader = ScopeShader(surface, tier, threads=1)
    casters = (caster,) if with_tool else ()
    whole = shader.shade(seen, camera, LIGHT, casters=casters)
    lattice = shader.lattice(seen.size, camera, LIGHT, casters)
    known = []
    row, column = (n // 3 for n in seen.size)
    for rows, columns in (
        (slice(row, row + 7), slice(column, column + 9)),
        (slice(0, 5), slice(None)),
        (slice(row - 3, row + 9), slice(column + 5, None)),
    ):
        only = np.zeros(seen.size, np.bool_)
        only[rows, columns] = True
        needed = only | shader.lattice_pixels(seen, only)
        # elsewhere: nothing is known of the tissue, nor what hides the tool
        depth = np.where(needed, seen.depth_mm, np.float32(np.inf))
        cover = np.where(needed, seen.coverage, np.float32(0))
        normal = np.where(needed[..., None], seen.normal, np.float32(0))
        part = GBuffer(depth, normal, cover, seen.material)
        found = shader.shade(part, camera, LIGHT, only=only, lattice=lattice)
        assert_array_equal(found[only], whole[only])
        known.append(int(lattice.gathered.sum() + lattice.followed.known.sum()))
    assert 0 < known[0] < known[1] < known[2]
    assert known[2] < lattice.gathered.size + lattice.followed.known.size
    with pytest.raises(ValueError, match="1 tools beside a lattice"):
        shader.shade(seen, camera, LIGHT, casters=[caster], lattice=lattice)
    shader.close()
