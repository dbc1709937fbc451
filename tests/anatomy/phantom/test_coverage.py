import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from anatomy.phantom.coverage import blur_mm, weights

length = st.floats(0.05, 3.0)


@given(st.floats(-5, 8), st.floats(0.1, 8), length, length, st.floats(0.1, 1.0))
def test_weights_add_to_one_and_none_is_negative(
    depth: float, total: float, mucosa: float, bone: float, blur: float
) -> None:
    w = weights(depth, total, mucosa, bone, blur)
    assert w.sum() == pytest.approx(1.0, abs=1e-12)
    assert w.min() > -1e-12


@given(st.floats(-2, 5), st.floats(0.3, 3), st.floats(0.2, 0.8))
def test_a_wall_looks_the_same_from_both_sides(
    depth: float, total: float, blur: float
) -> None:
    here = weights(depth, total, 0.4, 0.25, blur)
    there = weights(total - depth, total, 0.4, 0.25, blur)
    assert here == pytest.approx(there, abs=1e-12)


@pytest.mark.parametrize("spacing", [0.3, 0.5, 1.0])
@pytest.mark.parametrize("edge_blur", [0.25, 0.35, 0.6])
def test_bone_mass_does_not_depend_on_the_voxel(
    spacing: float, edge_blur: float
) -> None:
    # A 0.2 mm lamina between two airspaces, summed along its normal.
    blur = blur_mm(edge_blur, spacing)
    total = 2 * 0.4 + 0.2
    # The wall runs oblique through the grid, so its voxels have all offsets.
    depths = np.arange(-6, 7, spacing / 8)
    mass = spacing / 8 * sum(weights(d, total, 0.4, 0.1, blur)[2] for d in depths)
    assert mass == pytest.approx(0.2, rel=0.001)


def test_a_thin_septum_agrees_with_sampling() -> None:
    # Box filter and Gaussian over a plate between two airspaces, by brute force.
    rng = np.random.default_rng(0)
    spacing, edge_blur, depth = 0.5, 0.35, 0.45
    total, mucosa, bone = 1.05, 0.4, 0.125
    n = 400_000
    offset = rng.uniform(-spacing / 2, spacing / 2, n) + rng.normal(0, edge_blur, n)
    x = depth + offset
    near = np.minimum(x, total - x)
    expected = [
        np.mean(near < 0),
        np.mean((near >= 0) & (near < mucosa)),
        np.mean(near >= mucosa),
    ]
    found = weights(depth, total, mucosa, bone, blur_mm(edge_blur, spacing))
    assert found[:3] == pytest.approx(expected, abs=0.004)
    assert found[3] == pytest.approx(0.0, abs=1e-12)


def test_the_surface_lies_at_half_coverage() -> None:
    w = weights(0.0, 1e3, 1.0, 0.5, 0.38)
    assert w[0] == pytest.approx(0.5)


def test_the_blur_joins_scanner_and_voxel() -> None:
    assert blur_mm(0.3, 0.6) == pytest.approx(math.sqrt(0.09 + 0.03))
