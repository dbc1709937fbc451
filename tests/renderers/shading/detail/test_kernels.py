import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from renderers.shading.detail.kernels import exp_negative, octave, ramp, vessel
from renderers.shading.noise import TILE_SIZE, noise_tile, tile_from_mm

f32 = np.float32
coordinates = st.floats(-90, 90, width=32)


@pytest.fixture(scope="module")
def tile() -> NDArray[np.float32]:
    return noise_tile(4.0, 3)


def twin(
    tile: NDArray[np.float32], matrix: NDArray[np.float32], point: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Tap in float64: value, gradient per mm."""
    m = matrix.astype(np.float64)
    u = m @ point
    low = np.floor(u)
    part = u - low
    corner = low.astype(int)
    total = np.zeros(4)
    for c in range(8):
        step = np.array([c & 1, c >> 1 & 1, c >> 2])
        i, j, k = (corner + step) % TILE_SIZE
        total += np.prod(np.where(step, part, 1 - part)) * tile[k, j, i]
    return np.concatenate([total[:1], m.T @ total[1:]])


@given(x=coordinates, y=coordinates, z=coordinates)
def test_a_tap_is_the_trilinear_interpolation(
    tile: NDArray[np.float32], x: float, y: float, z: float
) -> None:
    maps = np.stack([tile_from_mm(1.6, 5.7, 1)])
    got = octave(tile.reshape(-1), maps, 0, f32(x), f32(y), f32(z), False)
    expected = twin(tile, maps[0], np.array([x, y, z]))
    # float32 places a point 90 mm out to 4e-5 tile voxels
    np.testing.assert_allclose(got, expected, atol=2e-3)


def test_it_repeats_with_the_tile(tile: NDArray[np.float32]) -> None:
    maps = np.eye(3, dtype=np.float32)[None]
    flat = tile.reshape(-1)
    here = octave(flat, maps, 0, f32(3.25), f32(-7.5), f32(11.75), False)
    there = octave(flat, maps, 0, f32(3.25 + 64), f32(-7.5 - 128), f32(75.75), False)
    assert here == there


def test_smooth_taps_agree_on_the_lattice(tile: NDArray[np.float32]) -> None:
    maps = np.eye(3, dtype=np.float32)[None]
    plain = octave(tile.reshape(-1), maps, 0, f32(5), f32(6), f32(7), False)
    smooth = octave(tile.reshape(-1), maps, 0, f32(5), f32(6), f32(7), True)
    assert plain == smooth
    assert [float(v) for v in plain] == tile[7, 6, 5].tolist()


@given(x=st.floats(-2, 3, width=32))
def test_the_ramp_is_monotone_between_its_ends(x: float) -> None:
    value = ramp(f32(0.25), f32(0.5), f32(x))
    assert 0 <= value <= 1
    assert value + ramp(f32(-0.5), f32(-0.25), f32(-x)) == pytest.approx(1, abs=1e-6)


def test_a_vessel_is_as_wide_as_its_radius_wherever_the_noise_is_flat() -> None:
    edge, fine = f32(1e-4), f32(1e-5)
    for slope in (0.2, 1.0, 5.0):
        for offset, inside in ((0.03, True), (0.05, False)):
            value = f32(offset * slope)
            cover = vessel(value, f32(slope), f32(0.042), edge, fine, f32(0.12))
            assert bool(cover > 0.99) is inside


def test_a_vessel_thinner_than_a_pixel_fades() -> None:
    def cover(footprint: float) -> float:
        return float(
            vessel(f32(0), f32(1), f32(0.04), f32(0.02), f32(footprint), f32(0.12))
        )

    assert cover(0.001) == 1
    # half the pixel, half the strength: its total stays the same
    assert cover(0.8) / cover(1.6) == pytest.approx(2, rel=0.1)
    assert vessel(f32(0), f32(0.1), f32(0.04), f32(0.02), f32(0.1), f32(0.12)) == 0
    assert vessel(f32(0), f32(1), f32(-0.01), f32(0.02), f32(0.1), f32(0.12)) == 0


@given(x=st.floats(-87, 0, width=32))
def test_exp_is_exp(x: float) -> None:
    assert exp_negative(f32(x)) == pytest.approx(
        math.exp(x), rel=1e-6 * (1 - x / 10), abs=1e-37
    )
