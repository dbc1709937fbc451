import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numba import njit
from numpy.typing import NDArray

from renderers.lanes import load, store
from renderers.shading.kernels.elementary import exp_negative, resolved, smooth

f32 = np.float32
Floats = NDArray[np.float32]
W = 16


@njit(error_model="numpy")
def call_functions(x: Floats, out: Floats) -> None:
    v = load(x, 0, W)
    store(out, 0, exp_negative(v))
    store(out, W, smooth(v))
    store(out, 2 * W, resolved(v, f32(0.5)))


@given(x=st.floats(-87, 0, width=32))
def test_exp_is_exp(x: float) -> None:
    out = np.zeros(3 * W, np.float32)
    call_functions(np.full(W, x, np.float32), out)
    assert out[0] == pytest.approx(math.exp(x), rel=1e-6 * (1 - x / 10), abs=1e-37)


def test_a_wave_fades_between_a_quarter_and_half_of_its_length() -> None:
    # wavelength 2
    x = np.linspace(0, 1.5, W).astype(np.float32)
    out = np.zeros(3 * W, np.float32)
    call_functions(x, out)
    faded = out[2 * W :]
    assert np.all(np.diff(faded) <= 0)
    assert np.all(faded[x <= 0.5] == 1)
    assert np.all(faded[x >= 1] == 0)
    np.testing.assert_allclose(np.interp(0.75, x, faded), 0.5, atol=0.01)
    np.testing.assert_allclose(out[W : 2 * W], x * x * (3 - 2 * x), rtol=1e-5)
