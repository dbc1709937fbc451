"""A lens's polynomial and its inverse."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from renderers.scene import Distortion

K = st.floats(-2, 2)


@given(K, K, st.lists(st.floats(0, 1), min_size=1, max_size=20))
def test_the_inverse_undoes_the_lens(k1: float, k2: float, shares: list[float]) -> None:
    lens = Distortion(k1, k2)
    u = np.array(shares) * min(0.999 * lens.fold, 3.0)
    found = lens.inverse(lens.of(u))
    # one number is found as many are
    alone = lens.inverse(lens.of(u)[0])
    assert float(alone) == pytest.approx(float(found[0]), rel=1e-14, abs=1e-300)
    # near the fold the slope is small and digits are lost with it
    slope = 1 + 3 * k1 * u**2 + 5 * k2 * u**4
    assume(slope.min() > 1e-6)
    assert np.all(np.abs(found - u) <= 1e-13 * (1 + u) / slope + 1e-15)


@given(K, K)
def test_up_to_the_fold_the_lens_rises_and_there_it_turns(k1: float, k2: float) -> None:
    lens = Distortion(k1, k2)
    end = min(lens.fold, 10.0)
    u = np.linspace(0, end * (1 - 1e-9), 400)
    assert np.all(np.diff(lens.of(u)) > 0)
    least, most = lens.stretches(end)
    assert least - 1e-12 <= lens.stretch(u).min()
    assert lens.stretch(u).max() <= most + 1e-12
    assert least > 0
    if math.isfinite(lens.fold):
        s = lens.fold**2
        assert 1 + 3 * k1 * s + 5 * k2 * s * s == pytest.approx(
            0, abs=1e-9 * (1 + s * s)
        )
        top = float(lens.of(np.array(lens.fold)))
        assert np.isnan(lens.inverse(np.array([top * 1.001]))).all()


def test_coefficients_that_cannot_be_are_refused() -> None:
    for wrong in (math.nan, math.inf, 101.0):
        with pytest.raises(ValueError, match=r"distortion k1 must be within"):
            Distortion(wrong)
        with pytest.raises(ValueError, match=r"distortion k2 must be within"):
            Distortion(0.0, wrong)
