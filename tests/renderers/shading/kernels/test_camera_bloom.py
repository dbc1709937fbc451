import numpy as np
import pytest
from numpy.typing import NDArray

from renderers.shading.kernels.camera_bloom import bloom_row
from renderers.shading.kernels.camera_blur import W
from renderers.shading.kernels.camera_expose import Planes

f32 = np.float32
TAPS = np.array([0.4, 0.2, 0.1], np.float32)
MARGIN = SMALL_MARGIN = W


def bloom(
    small: NDArray[np.float32], width: int, glare: float, halo: float, first: int
) -> tuple[NDArray[np.float32], list[bool]]:
    """Give the bloom rows from `first` on, full width with one margin pixel a side."""
    rows, _, columns = small.shape
    small_pitch = -(-columns // W) * W + 2 * SMALL_MARGIN
    pitch = -(-width // W) * W + 2 * MARGIN
    padding = [(0, 0), (0, 0), (SMALL_MARGIN, small_pitch - SMALL_MARGIN - columns)]
    planes = Planes(
        np.empty((4 * rows, 3 * pitch), np.float32),
        np.pad(small, padding, mode="edge").reshape(rows, -1),
        np.array([row.any() for row in small], np.uint8),
        MARGIN,
        SMALL_MARGIN,
    )
    ring = np.zeros((2 * len(TAPS), 3 * small_pitch), np.float32)
    places = np.empty((len(TAPS), 2), np.int64)
    wide = np.zeros((2, 3 * pitch + 4 * W), np.float32)
    found, lit = [], []
    known = 0
    for row in range(first, rows):
        lit.append(
            bloom_row(
                planes, row, known, TAPS, f32(glare), f32(halo), ring, places, width,
                wide, 0, wide.shape[1],
            )
        )  # fmt: skip
        known = min(row + len(TAPS), rows)
        line = wide[0, : 3 * pitch].reshape(3, pitch)
        found.append(line[:, MARGIN - 1 : MARGIN + width + 1].copy())
    return np.array(found), lit


@pytest.mark.parametrize(("columns", "width"), [(8, 32), (9, 33), (31, 121)])
def test_a_constant_stays_constant_into_the_margins(columns: int, width: int) -> None:
    small = np.full((7, 3, columns), 0.25, np.float32)
    got, lit = bloom(small, width, 0.5, 1.0, 0)
    np.testing.assert_allclose(got, 0.25 * 1.5, rtol=1e-6)
    assert all(lit)


def test_glare_is_interpolated_between_centres() -> None:
    small = np.zeros((3, 3, 10), np.float32)
    small[:] = np.arange(1, 11)
    got, _ = bloom(small, 40, 1.0, 0.0, 0)
    x = np.arange(40)
    expected = np.interp((x - 1.5) / 4, np.arange(10), np.arange(1.0, 11))
    np.testing.assert_allclose(got[1, 2, 1:-1], expected, rtol=1e-6)
    np.testing.assert_allclose(got[1, 2, [0, -1]], [1, 10])


@pytest.mark.parametrize("first", [0, 3])
def test_the_halo_is_the_blurred_glare(first: int) -> None:
    small = np.zeros((12, 3, 9), np.float32)
    small[5, 1, 4] = 1.0
    got, lit = bloom(small, 36, 0.0, 2.0, first)
    assert [row + first for row, any_ in enumerate(lit) if any_] == [3, 4, 5, 6, 7]
    profile = np.array([0.1, 0.2, 0.4, 0.2, 0.1])
    centres = got[3 - first : 8 - first, 1, 1:-1].reshape(5, 9, 4)[:, 2:7]
    # the pixels beside a centre lie an eighth of the way towards its neighbours
    mean = centres[..., 1:3].mean(axis=-1)
    along = np.convolve(profile, [1 / 16, 7 / 8, 1 / 16], mode="same")
    along[[0, -1]] = 7 / 8 * 0.1 + 0.2 / 16
    np.testing.assert_allclose(mean, 2 * profile[:, None] * along, atol=1e-6)
    assert not got[3 - first : 8 - first, [0, 2]].any()


def test_nothing_is_made_of_the_dark() -> None:
    _, lit = bloom(np.zeros((5, 3, 9), np.float32), 36, 1.0, 1.0, 0)
    assert not any(lit)
