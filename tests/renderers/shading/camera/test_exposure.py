import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from renderers.scene import Material
from renderers.shading import AutoGain, meter
from renderers.shading.camera.exposure import HIGHLIGHT, LARGEST_GAIN, TARGET

gains = st.floats(1e-2, 1e4)


def field(radiance: float, size: int = 96) -> NDArray[np.float32]:
    return np.full((size, size, 3), radiance, np.float32)


@given(radiance=st.floats(1e-4, 10))
def test_an_even_field_is_brought_to_the_target(radiance: float) -> None:
    assert meter(field(radiance)) * radiance == pytest.approx(TARGET, rel=1e-4)


def test_gain_is_inverse_to_light() -> None:
    rng = np.random.default_rng(0)
    picture = rng.gamma(0.7, 0.01, (128, 128, 3)).astype(np.float32)
    assert meter(2 * picture) == pytest.approx(meter(picture) / 2, rel=1e-5)


def test_highlights_hold_the_gain_down() -> None:
    # a bright ring: too light in weight for the mean, but half of the field
    picture = field(0.001)
    y, x = np.indices((96, 96)) - 47.5
    picture[np.hypot(x, y) > 0.7 * 48] = 1.0
    gain = meter(picture)
    assert gain == pytest.approx(HIGHLIGHT, rel=1e-6)


def test_the_target_is_a_mean_of_clipped_light() -> None:
    # a small glint in the centre may not darken the picture by more than its area
    picture = field(0.01, 192)
    picture[94:98, 94:98] = 100.0
    assert meter(picture) * 0.01 == pytest.approx(TARGET, rel=0.02)


@given(share=st.floats(0.05, 0.75), bright=st.floats(0, 1e3), tissue=st.floats(1e-3, 1))
def test_a_tool_does_not_decide_how_bright_tissue_is(
    share: float, bright: float, tissue: float
) -> None:
    """Wherever it lies, however bright it is: by a quarter of a stop at most."""
    picture = field(tissue)
    material = np.zeros(picture.shape[:2], np.uint8)
    tool = slice(round(96 * (1 - share)), None)
    picture[tool], material[tool] = bright * tissue, Material.METAL
    bare, gain = meter(field(tissue)), meter(picture, material)
    assert abs(math.log2(gain / bare)) < 0.25
    assert meter(picture, np.zeros_like(material)) == meter(picture)


def test_a_picture_of_nothing_but_a_tool_is_exposed_too() -> None:
    steel = np.full((96, 96), Material.METAL, np.uint8)
    picture = np.random.default_rng(1).gamma(0.7, 0.01, (96, 96, 3))
    light = picture.astype(np.float32)
    assert meter(light, steel) == pytest.approx(meter(light), rel=1e-6)


def test_black_gets_the_largest_gain() -> None:
    assert meter(field(0)) == LARGEST_GAIN


@given(start=gains, target=gains, a=st.floats(0, 2), b=st.floats(0, 2))
def test_two_steps_do_what_their_sum_does(
    start: float, target: float, a: float, b: float
) -> None:
    twice, once = AutoGain(gain=start), AutoGain(gain=start)
    twice.follow(target, a)
    assert twice.follow(target, b) == pytest.approx(
        once.follow(target, a + b), rel=1e-9
    )


def test_it_closes_the_gap_but_for_1_e_in_one_time_constant() -> None:
    auto = AutoGain(time_constant_s=0.2, gain=1.0)
    assert math.log(auto.follow(math.e, 0.2)) == pytest.approx(1 - 1 / math.e)


def test_the_first_picture_is_exposed_at_once() -> None:
    assert AutoGain().follow(37.0, 0.0) == 37.0


def test_nonsense_is_refused() -> None:
    with pytest.raises(ValueError, match="time constant"):
        AutoGain(time_constant_s=0)
    with pytest.raises(ValueError, match="gain is positive"):
        AutoGain().follow(-1, 0.1)
    with pytest.raises(ValueError, match="backwards"):
        AutoGain().follow(1, -0.1)
