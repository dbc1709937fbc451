import numpy as np
import pytest
from numpy.testing import assert_array_equal
from numpy.typing import NDArray

from renderers.shading.kernels.surface_noise import TILE_SIZE
from renderers.shading.noise import noise_tile, stored_tile, tile_from_mm


@pytest.fixture(scope="module")
def tile() -> NDArray[np.float32]:
    return noise_tile(4.0, 3)


def test_values_have_zero_mean_and_unit_deviation(tile: NDArray[np.float32]) -> None:
    assert tile.shape == (TILE_SIZE,) * 3 + (4,)
    assert float(tile[..., 0].mean()) == pytest.approx(0, abs=1e-6)
    assert float(tile[..., 0].std()) == pytest.approx(1, abs=1e-5)


def test_it_repeats_without_a_seam(tile: NDArray[np.float32]) -> None:
    # the step across the border is a step like any other
    for axis in range(3):
        inside = np.diff(tile[..., 0], axis=axis).std()
        seam = (tile[..., 0].take(0, axis) - tile[..., 0].take(-1, axis)).std()
        assert float(seam) == pytest.approx(float(inside), rel=0.1)


def test_gradients_are_the_values_central_differences(
    tile: NDArray[np.float32],
) -> None:
    for axis, channel in ((2, 1), (1, 2), (0, 3)):
        value = tile[..., 0]
        expected = (np.roll(value, -1, axis) - np.roll(value, 1, axis)) / 2
        np.testing.assert_allclose(tile[..., channel], expected, atol=1e-6)


def test_the_seed_decides_every_bit() -> None:
    assert_array_equal(noise_tile(8.0, 5), noise_tile(8.0, 5))
    assert not np.array_equal(noise_tile(8.0, 5), noise_tile(8.0, 6))


def test_its_wavelength_is_the_one_asked_for() -> None:
    power = np.abs(np.fft.fftn(noise_tile(8.0, 1)[..., 0])) ** 2
    k = np.fft.fftfreq(TILE_SIZE)
    radius = np.sqrt(k[:, None, None] ** 2 + k[:, None] ** 2 + k**2)
    mean = float((radius * power).sum() / power.sum())
    # a shell about .7 / 8, a little beyond because a shell has more room outside
    assert 0.7 / 8 <= mean <= 1 / 8


def test_octave_maps_turn_and_scale_only() -> None:
    for turn in range(3):
        matrix = tile_from_mm(1.6, 5.7, turn).astype(np.float64)
        np.testing.assert_allclose(
            matrix @ matrix.T, np.eye(3) * (5.7 / 1.6) ** 2, atol=1e-5
        )
        assert np.linalg.det(matrix) > 0


def test_impossible_wavelengths_are_refused() -> None:
    with pytest.raises(ValueError, match=r"shortest wavelength.*got 1"):
        noise_tile(1, 0)
    with pytest.raises(ValueError, match="positive"):
        tile_from_mm(0, 5.7, 0)


def test_a_stored_tile_is_the_tile_and_closes_upon_itself() -> None:
    tile = noise_tile(8.0, 3)
    stored = stored_tile(tile)
    n = TILE_SIZE
    quads = stored.quads.reshape(n + 1, n + 1, n + 1, 4)
    back = quads[:n, :n, :n] * stored.unit
    np.testing.assert_allclose(back, tile, atol=0.51 * float(stored.unit))
    assert float(stored.unit) < 3e-4
    for axis in range(3):
        assert_array_equal(quads.take(n, axis), quads.take(0, axis))
