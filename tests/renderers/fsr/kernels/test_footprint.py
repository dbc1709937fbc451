"""How a footprint falls off and how opaque its centre must be."""

import math

import numpy as np
import pytest
from numba import njit
from numpy.typing import NDArray

from renderers.fsr.kernels.footprint import (
    CUT,
    DEEPEST,
    PEAK,
    SCALE,
    WEIGHT,
    gaussian_falloff,
)
from renderers.fsr.kernels.tile_buffer import SQUARE
from renderers.fsr.splats.shaded_set import splat_peaks
from renderers.simd import load, store
from tests.renderers.fsr.kernel_peaks import kernel_peaks
from tests.renderers.fsr.plain_footprint import gaussian_footprint, sheet_opacities

F32 = NDArray[np.float32]


def test_peaks_give_sheets_their_optical_depth() -> None:
    """Against the opacity of an infinite lattice of splats blended one by one."""
    wanted = np.linspace(0, 1, 256)
    depths = -np.log1p(-sheet_opacities()).astype(np.float32)
    found = kernel_peaks(depths)
    np.testing.assert_allclose(found, wanted, atol=3e-7)


def test_faint_splats_are_right_in_proportion() -> None:
    depths = np.array([1e-6, 1e-4, 1e-2], np.float32)
    opacities = sheet_opacities()
    slope = 1 / 255 / -np.log1p(-opacities[1])
    # the line through none and the first of 255 steps bends by a thousandth
    np.testing.assert_allclose(kernel_peaks(depths) / depths, slope, rtol=1.5e-3)


def test_denser_is_never_clearer_and_nothing_is_beyond_one() -> None:
    depths = np.linspace(0, DEEPEST, 20_000, dtype=np.float32)
    peaks = kernel_peaks(depths)
    assert np.diff(peaks).min() >= -1e-7
    deepest, beyond = kernel_peaks(np.array([DEEPEST, np.inf], np.float32))
    assert beyond == deepest
    assert 1 <= deepest < 1.001
    assert PEAK[0] == np.polynomial.Polynomial(PEAK)(0)


def test_the_footprint_is_the_gaussian_to_one_in_eight_thousand() -> None:
    """One at the centre, nothing from the cut on, and nearly the Gaussian's mass."""
    r2 = np.linspace(0, CUT**2, 4001)
    weights = np.array([weight(math.sqrt(d)) for d in r2])
    truth = gaussian_footprint(r2)
    assert weights[0] == pytest.approx(1, abs=1e-6)
    assert np.abs(weights - truth).max() < 1.25e-4
    assert np.all(np.diff(weights) <= 0)
    assert weights.mean() == pytest.approx(truth.mean(), rel=2e-5)
    for beyond in (CUT, 3.1, 31, 1e15):
        assert weight(beyond) == 0


@njit(error_model="numpy")
def weigh(record: F32, right: F32, weights: F32) -> None:
    """Weigh sixteen pixels of one row."""
    u = load(right, 0, SQUARE)
    store(weights, 0, gaussian_falloff(record, 0, u, u - u))


def weight(sigmas: float) -> float:
    """Weigh a pixel so far right of a round footprint's centre."""
    round_ = SCALE / np.float32(CUT**2)
    record = np.array([0, 0, round_, 0, round_] + [0] * 16, np.float32)
    weights = np.zeros(SQUARE, np.float32)
    weigh(record, np.full(SQUARE, sigmas, np.float32), weights)
    assert np.all(weights == weights[0])
    return float(weights[0] * WEIGHT)


def test_peaks_are_the_kernels() -> None:
    depths = np.concatenate([[0.0], np.geomspace(1e-6, 30, 500)])
    found = splat_peaks(depths)
    wanted = np.minimum(kernel_peaks(depths), 1)
    np.testing.assert_allclose(found, wanted, rtol=1e-5, atol=1e-6)
    assert found[0] == 0
    assert found[-1] == 1
