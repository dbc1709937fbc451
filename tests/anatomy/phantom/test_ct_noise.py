import numpy as np
import pytest

from anatomy.phantom.ct_noise import ct_noise
from anatomy.phantom.lattice import Lattice

BOX = ((-20.0, 20.0), (-20.0, 20.0), (-20.0, 20.0))


@pytest.mark.parametrize("spacing", [0.5, 0.8])
def test_noise_has_the_deviation_asked_for(spacing: float) -> None:
    noise = ct_noise(Lattice.covering(spacing, BOX), 3, 12.0)
    assert noise.std() == pytest.approx(12.0, rel=0.04)
    assert abs(noise.mean()) < 0.2


def test_noise_is_band_passed_as_by_a_kernel() -> None:
    noise = ct_noise(Lattice.covering(0.5, BOX), 3, 12.0)
    power = np.abs(np.fft.fftn(noise)) ** 2
    axes = np.meshgrid(*(np.fft.fftfreq(n, 0.5) for n in noise.shape), indexing="ij")
    frequency = np.sqrt(sum(f**2 for f in axes))

    def mean(low: float, high: float) -> float:
        return float(power[(frequency >= low) & (frequency < high)].mean())

    peak = mean(0.2, 0.3)
    assert mean(0.0, 0.05) < 0.1 * peak
    assert mean(0.7, 0.9) < 0.1 * peak
    # Neighbours are alike, which white noise is not.
    assert np.corrcoef(noise[:, :, 1:].ravel(), noise[:, :, :-1].ravel())[0, 1] > 0.5


def test_noise_depends_on_the_place_and_the_seed_alone() -> None:
    whole = Lattice.covering(0.8, BOX)
    part = Lattice.covering(0.8, ((-6.0, 9.0), (-11.0, 2.0), (-3.0, 16.0)))
    large, small = ct_noise(whole, 3, 12.0), ct_noise(part, 3, 12.0)
    x, y, z = (b - a for a, b in zip(whole.first, part.first, strict=True))
    nz, ny, nx = part.shape
    assert np.array_equal(small, large[z : z + nz, y : y + ny, x : x + nx])
    assert not np.array_equal(small, ct_noise(part, 4, 12.0))
