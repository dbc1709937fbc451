"""Walls thinner than a voxel: their CT numbers, their mass, and a real scan."""

import numpy as np
import pytest
from scipy import ndimage

from anatomy.phantom.coverage import blur_mm, weights
from anatomy.tissue import TISSUES, Side
from benchmarks.phantom_figures.wall_peaks import lamina_peaks, septa_head, septum_peaks

HU = np.array([TISSUES[n].hu for n in ("air", "mucosa", "thin bone", "fat")])


def smoothed_box(value: np.ndarray, step: float, h: float, sigma: float) -> np.ndarray:
    """Average along the last axis over a voxel, then blur by the scanner."""
    boxed = ndimage.uniform_filter1d(value, max(1, round(h / step)), axis=-1)
    blurred: np.ndarray = ndimage.gaussian_filter1d(boxed, sigma / step, axis=-1)
    return blurred


@pytest.mark.parametrize("h", [0.3, 0.5, 1.0])
@pytest.mark.parametrize("sigma", [0.25, 0.35, 0.6])
@pytest.mark.parametrize("bone", [0.2, 0.4, 0.8])
def test_a_wall_has_the_ct_numbers_of_finely_sampled_layers(
    h: float, sigma: float, bone: float
) -> None:
    # A septum between two airspaces, with mucosa on both sides, along its normal.
    mucosa, step = 0.4, 0.005
    total = 2 * mucosa + bone
    x = np.arange(-8.0, 8.0 + total, step)
    depth = np.minimum(x, total - x)
    layer = np.where(depth < 0, 0, np.where(depth < mucosa, 1, 2))
    exact = smoothed_box(HU[layer], step, h, sigma)
    blur = blur_mm(sigma, h)
    inside = slice(400, len(x) - 400, 20)
    found = np.array([weights(d, total, mucosa, bone / 2, blur) for d in x[inside]])
    assert found.sum(axis=1) == pytest.approx(1.0, abs=1e-5)
    near = np.abs(x[inside] - total / 2) < 3.0
    error = (found @ HU - exact[inside])[near]
    # The Gaussian stands for the voxel's box: exact enough while it is narrower than
    # the scanner's blur; a voxel of 1 mm with a sharp kernel is the worst case.
    limit = 15.0 if h <= 1.5 * sigma else 60.0
    assert np.sqrt(np.mean(error**2)) < limit
    assert np.percentile(np.abs(error), 99.9) < (120.0 if h <= 1.5 * sigma else 180.0)


def test_ethmoid_septa_look_as_in_a_scan_with_a_standard_kernel() -> None:
    phantom = septa_head()
    found = septum_peaks(phantom)
    assert len(found) > 300
    assert np.median(found) == pytest.approx(-254.0, abs=120.0)
    deep = phantom.distance.values < -2.5
    # The scan's air has a median of -996 HU.
    assert np.median(phantom.ct.values[deep]) == pytest.approx(-1000.0, abs=10.0)


@pytest.mark.parametrize("side", [Side.RIGHT, Side.LEFT])
def test_the_orbits_medial_wall_is_as_faint_as_in_a_scan(side: Side) -> None:
    found = lamina_peaks(side)
    assert len(found) > 100
    assert np.median(found) == pytest.approx(50.0, abs=60.0)
