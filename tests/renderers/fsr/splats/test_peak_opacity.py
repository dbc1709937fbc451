"""How opaque a splat's centre must be."""

import numpy as np

from renderers.fsr.footprint import sheet_opacities
from renderers.fsr.splats.peak_opacity import DEEPEST, PEAK
from tests.renderers.fsr.kernel_peaks import kernel_peaks


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
