"""What a picture stopped early is said to be off by, against what it is."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from renderers.snapshots.error_estimate import stopped_error

SIZE = 96


def stepped(picture: NDArray[np.float32], block: int) -> NDArray[np.float32]:
    """Show each block's middle in all of it, as nearest coarse rays do."""
    half = block // 2
    middles = [
        picture[half - r :: block, half - c :: block] for r in (0, 1) for c in (0, 1)
    ]
    middle = np.mean(middles, axis=0)
    wide = np.repeat(np.repeat(middle, block, axis=0), block, axis=1)
    return np.asarray(wide, dtype=np.float32)


def wavy(seed: int, length_px: float) -> NDArray[np.float32]:
    noise = np.random.default_rng(seed).normal(size=(SIZE, SIZE, 3))
    smooth = gaussian_filter(noise, (length_px, length_px, 0), mode="wrap")
    return np.asarray(40 * smooth / smooth.std() + 120, dtype=np.float32)


EVERYWHERE = np.ones((SIZE, SIZE), np.bool_)


@pytest.mark.parametrize("block", [2, 4, 8, 16])
def test_a_ramp_is_off_by_its_slope(block: int) -> None:
    ramp = np.zeros((SIZE, SIZE, 3), np.float32)
    ramp += 0.7 * np.arange(SIZE, dtype=np.float32)[:, None, None]
    shown = stepped(ramp, block)
    true = np.sqrt(((shown - ramp) ** 2).mean())
    found = stopped_error(shown, ~EVERYWHERE, block, EVERYWHERE)
    # a pixel is no point: sqrt(1 - 1 / block^2)
    assert found == pytest.approx(true / np.sqrt(1 - block**-2), rel=1e-5)


def test_what_is_whole_has_no_error_and_what_does_not_count_none_either() -> None:
    picture = wavy(1, 6)
    assert stopped_error(picture, EVERYWHERE, 8, EVERYWHERE) == 0
    upper = EVERYWHERE.copy()
    upper[SIZE // 2 :] = False
    assert stopped_error(picture, upper, 8, upper) == 0
    assert stopped_error(picture, ~upper, 8, upper) > 0


@given(
    st.integers(0, 2**31),
    st.sampled_from([2, 4, 8, 16]),
    st.floats(3, 20),
    st.integers(0, SIZE - 8),
)
def test_the_estimate_is_near_the_truth(
    seed: int, block: int, length_px: float, rows: int
) -> None:
    """From above, as far as rows; with and without traced blocks to learn from.

    Where what is seen changes within a block its middle says little.
    """
    length_px = max(length_px, 0.75 * block)
    fine = wavy(seed, length_px)
    drawn = np.zeros((SIZE, SIZE), np.bool_)
    drawn[:rows] = True
    shown = np.where(drawn[..., None], fine, stepped(fine, block))
    true = np.sqrt(((shown - fine) ** 2).mean())
    found = stopped_error(shown, drawn, block, EVERYWHERE)
    assert true / 2.5 < found < 2.5 * true


def test_sharp_detail_that_was_traced_is_expected_elsewhere_too() -> None:
    """Steps between blocks do not show it; the traced half does."""
    fine = wavy(3, 20)
    fine[::3, ::3] += 60
    drawn = np.zeros((SIZE, SIZE), np.bool_)
    drawn[: SIZE // 2] = True
    shown = np.where(drawn[..., None], fine, stepped(wavy(3, 20), 4))
    true = np.sqrt(((shown - fine) ** 2).mean())
    learnt = stopped_error(shown, drawn, 4, EVERYWHERE)
    unlearnt = stopped_error(shown, ~EVERYWHERE, 4, EVERYWHERE) / np.sqrt(2)
    assert abs(learnt - true) < abs(unlearnt - true)
    assert true / 3 < learnt < 3 * true


def test_a_picture_smaller_than_a_block_is_one() -> None:
    picture = np.full((5, 7, 3), 9, np.float32)
    all_of_it = np.ones((5, 7), np.bool_)
    assert stopped_error(picture, ~all_of_it, 16, all_of_it) == 0
