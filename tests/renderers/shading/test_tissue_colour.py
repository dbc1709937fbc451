import numpy as np
import pytest
from numpy.typing import NDArray

from renderers.shading.tissue_colour import (
    _RGB_FROM_XYZ,
    FRESH_BLOOD,
    TABLE_SIZE,
    WAVELENGTHS_NM,
    TissueOptics,
    colour_table,
)


def chromaticity(color: NDArray[np.float64]) -> tuple[float, float]:
    """Give CIE 1931 ``(x, y)`` of a linear sRGB colour ``(3,)`` (white D65)."""
    xyz = np.linalg.solve(_RGB_FROM_XYZ, np.asarray(color, dtype=np.float64))
    return float(xyz[0] / xyz.sum()), float(xyz[1] / xyz.sum())


def test_a_healthy_turbinate_has_the_measured_chromaticity() -> None:
    x, y = chromaticity(TissueOptics(0.12).color())
    assert x == pytest.approx(0.4262, abs=5e-4)
    assert y == pytest.approx(0.3274, abs=5e-4)


@pytest.mark.parametrize("blood", [0.07, 0.09, 0.12, 0.15, 0.2])
def test_mucosa_stays_within_the_clinical_range(blood: float) -> None:
    # Am. J. Rhinol. 2002;16:11: extremes of 60 people
    x, y = chromaticity(TissueOptics(blood).color())
    assert 0.4013 <= x <= 0.4539
    assert 0.3065 <= y <= 0.3379


def test_white_is_neutral() -> None:
    # D65: what equal linear channels are
    assert chromaticity(np.ones(3)) == pytest.approx((0.3127, 0.3290), abs=1e-3)


def test_without_absorption_everything_is_reflected() -> None:
    clear = TissueOptics(0.0, base_per_cm=0.0)
    np.testing.assert_allclose(clear.reflectance(), 1.0, rtol=1e-12)
    np.testing.assert_allclose(clear.color(), 1.0, rtol=1e-12)


def test_reflectance_depends_on_the_ratio_of_coefficients_only() -> None:
    thin = TissueOptics(0.1, scattering_per_cm=10, base_per_cm=0.1)
    thick = TissueOptics(0.2, scattering_per_cm=20, base_per_cm=0.2)
    np.testing.assert_allclose(thin.reflectance(), thick.reflectance(), rtol=1e-12)


def test_more_blood_is_darker_and_light_creeps_less_far() -> None:
    table = colour_table()
    assert table.shape == (TABLE_SIZE, 5)
    assert table.dtype == np.float32
    assert np.all(np.diff(table, axis=0) <= 0)
    # green is absorbed far more than red
    assert np.all(table[10:, 3] > 2 * table[10:, 4])


def test_the_table_is_indexed_by_the_square_root() -> None:
    row = 88
    blood = (row / 255) ** 2
    table = colour_table()
    np.testing.assert_allclose(table[row, :3], TissueOptics(blood).color(), rtol=1e-6)


def test_diffusion_length_of_a_flat_spectrum_is_the_textbook_value() -> None:
    flat = TissueOptics(
        0.0, scattering_per_cm=10, scattering_power=0, base_per_cm=0, pigment_per_cm=0
    )
    absorption, scattering = flat.coefficients()
    assert absorption.shape == WAVELENGTHS_NM.shape
    assert np.all(absorption == 0)
    assert np.all(scattering == 10)


def test_blood_is_the_darkest_red() -> None:
    red, green, blue = FRESH_BLOOD.color()
    assert red > 8 * green
    assert red > 8 * blue
