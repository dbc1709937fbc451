"""Opacity and powers against the library's functions in double precision."""

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from renderers.art.kernels.opacity_scalar import opacity, power


@given(st.floats(0, 2000, width=32))
def test_opacity(depth: float) -> None:
    exact = -math.expm1(-depth)
    assert abs(opacity(np.float32(depth)) - exact) <= 4e-7 * exact + 1e-44


def test_thin_segments_lose_no_digit() -> None:
    for depth in np.float32(10.0) ** np.arange(-30, 0):
        assert opacity(depth) / -math.expm1(-float(depth)) - 1 < 3e-7


@given(
    # Bases are cosines: 0, or far from the range where float32 loses digits.
    st.floats(0, 1.0009765625, width=32, allow_subnormal=False),
    st.one_of(st.floats(0, 200, width=32), st.integers(0, 200)),
)
def test_power(base: float, exponent: float) -> None:
    exact = base**exponent
    found = power(np.float32(base), np.float32(exponent))
    assert abs(found - exact) <= 3e-7 * (1 + exponent) * exact + 2e-38


def test_powers_of_nothing() -> None:
    zero, one = np.float32(0), np.float32(1)
    assert power(zero, zero) == 1
    assert power(zero, one) == 0
    assert power(one, np.float32(1e6)) == 1
