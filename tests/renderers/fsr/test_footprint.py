import numpy as np
import pytest
from numpy.typing import NDArray

from renderers.fsr.footprint import (
    CUT_SIGMAS,
    SIGMA_PER_SPACING,
    gaussian_footprint,
    sheet_opacities,
)
from renderers.fsr.lit_splats import splat_peaks


def sheet(peak: float, sigma: float) -> NDArray[np.float64]:
    """Blend a 7 x 7 unit lattice one by one; opacity over the middle cell."""
    y, x = np.meshgrid(*[np.linspace(2.5, 3.5, 41)] * 2, indexing="ij")
    clear = np.ones_like(x)
    for j in range(7):
        for i in range(7):
            r2 = ((x - i) ** 2 + (y - j) ** 2) / sigma**2
            clear *= 1 - peak * gaussian_footprint(r2)
    return 1 - clear


def test_footprint_is_one_at_the_centre_and_meets_zero_at_the_cut() -> None:
    assert gaussian_footprint(np.array(0.0)) == 1
    r = np.linspace(0, 5, 501)
    g = gaussian_footprint(r**2)
    assert np.all(np.diff(g) <= 0)
    assert g[r > CUT_SIGMAS].max() == 0
    assert 0 < gaussian_footprint(np.array((CUT_SIGMAS - 0.01) ** 2)) < 1e-3


@pytest.mark.parametrize("wanted", [0.05, 0.3, 0.7, 0.95])
def test_calibrated_peaks_give_the_wanted_mean_and_little_ripple(wanted: float) -> None:
    peak = float(splat_peaks(-np.log1p(-np.array(wanted))))
    opacity = sheet(peak, SIGMA_PER_SPACING)
    # the outer phases of the sampled cell count half
    mean = np.trapezoid(np.trapezoid(opacity, axis=0), axis=0) / 40**2
    assert mean == pytest.approx(wanted, rel=0.02)
    assert np.ptp(opacity) * 255 < 15


def test_known_peaks() -> None:
    """Solved independently for the uncut Gaussian, which has 5 % more mass."""
    peaks = np.linspace(0, 1, 256)
    for opacity, peak in ((0.7, 0.463), (0.95, 0.915)):
        assert np.interp(opacity, sheet_opacities(0.6), peaks) == pytest.approx(
            peak, rel=0.06
        )


def test_unreachable_opacities_take_the_full_peak() -> None:
    assert sheet_opacities()[-1] < 0.98
    depths = np.linspace(0, 10, 400)
    assert splat_peaks(depths)[-1] == 1
    assert np.all(np.diff(splat_peaks(depths)) >= -1e-7)
