import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numba import njit
from numpy.testing import assert_array_equal
from numpy.typing import NDArray

from renderers.lanes import load, store
from renderers.shading.kernels.camera_tone import exp2, log2

f32 = np.float32
LANES = 16
Floats = NDArray[np.float32]


@njit(error_model="numpy")
def powers(values: Floats, power: Floats, logarithm: Floats) -> None:
    store(power, 0, exp2(load(values, 0, LANES)))
    store(logarithm, 0, log2(load(values, 0, LANES)))


def exp2_and_log2(values: Floats) -> tuple[Floats, Floats]:
    power, logarithm = np.empty(LANES, np.float32), np.empty(LANES, np.float32)
    powers(values, power, logarithm)
    return power, logarithm


def all_lanes(value: float) -> Floats:
    return np.full(LANES, value, np.float32)


@given(x=st.floats(-100, 100, width=32))
def test_exp2_is_exp2(x: float) -> None:
    got, _ = exp2_and_log2(all_lanes(x))
    assert np.all(got == got[0])
    assert got[0] == pytest.approx(2.0**x, rel=5e-7)


@given(x=st.floats(f32(1e-30).item(), f32(1e30).item(), width=32))
def test_log2_is_log2(x: float) -> None:
    _, got = exp2_and_log2(all_lanes(x))
    assert np.all(got == got[0])
    assert got[0] == pytest.approx(math.log2(x), rel=1e-6, abs=1e-6)


def test_logarithms_of_powers_of_two_are_exact() -> None:
    k = np.arange(-8, 8)
    _, got = exp2_and_log2((2.0**k).astype(np.float32))
    assert_array_equal(got, k)


def test_what_has_no_logarithm_stays_finite() -> None:
    assert exp2_and_log2(all_lanes(0.0))[1][0] == -127
    assert exp2_and_log2(all_lanes(-1e9))[0][0] == pytest.approx(2.0**-126)
