"""Opacity and powers against the library's functions in double precision."""

import math
from typing import Any

import numpy as np
from hypothesis import example, given
from hypothesis import strategies as st
from numba import njit
from numpy.typing import NDArray

from renderers.art.kernels.opacity import opacity, power
from renderers.simd import load, store


def kernels(width: int) -> tuple[Any, Any]:
    """Compile both for arrays of so many numbers, one after the other."""

    @njit
    def opacities(x: Any, out: Any) -> None:
        for i in range(0, len(x), width):
            store(out, i, opacity(load(x, i, width)))

    @njit
    def powers(x: Any, exponent: Any, out: Any) -> None:
        for i in range(0, len(x), width):
            store(out, i, power(load(x, i, width), exponent))

    return opacities, powers


OPACITIES, POWERS = kernels(4)


def opacity_of(*depths: float) -> NDArray[np.float32]:
    depth, found = np.zeros(4, np.float32), np.zeros(4, np.float32)
    depth[: len(depths)] = depths
    OPACITIES(depth, found)
    return found[: len(depths)]


def power_of(base: float, exponent: float) -> float:
    found = np.zeros(4, np.float32)
    POWERS(np.full(4, base, np.float32), np.float32(exponent), found)
    assert (found == found[0]).all()
    return float(found[0])


@example([1e-30, 1e-20, 1e-9, 1e-4])
@given(st.lists(st.floats(0, 2000, width=32), min_size=1, max_size=4))
def test_opacity(depths: list[float]) -> None:
    for depth, found in zip(depths, opacity_of(*depths), strict=True):
        exact = -math.expm1(-depth)
        assert abs(found - exact) <= 4e-7 * exact + 1e-44


@example(0, 0)
@example(0, 1)
@example(1, 1e6)
@given(
    # Bases are cosines: 0, or far from the range where float32 loses digits.
    st.floats(0, 1.0009765625, width=32, allow_subnormal=False),
    st.one_of(st.floats(0, 200, width=32), st.integers(0, 200)),
)
def test_power(base: float, exponent: float) -> None:
    exact = base**exponent
    found = power_of(base, exponent)
    assert abs(found - exact) <= 3e-7 * (1 + exponent) * exact + 2e-38
