import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numba import njit
from numpy.typing import NDArray

from renderers.lanes import load, store
from renderers.shading.kernels.elementary import exp_negative

Floats = NDArray[np.float32]
W = 16


@njit(error_model="numpy")
def exponentials(x: Floats, out: Floats) -> None:
    store(out, 0, exp_negative(load(x, 0, W)))


@given(x=st.floats(-87, 0, width=32))
def test_exp_is_exp(x: float) -> None:
    out = np.zeros(W, np.float32)
    exponentials(np.full(W, x, np.float32), out)
    assert out[0] == pytest.approx(math.exp(x), rel=1e-6 * (1 - x / 10), abs=1e-37)
