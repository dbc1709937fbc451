"""Opacity and powers against the library's functions in double precision."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from numba import njit
from numpy.typing import NDArray

from renderers.art.kernels.opacity import opacity, power
from renderers.lanes import load, store


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


def test_what_is_clear_is_exactly_clear_and_what_is_opaque_exactly_opaque() -> None:
    assert opacity_of(0.0, 80.0, 1e9).tolist() == [0.0, 1.0, 1.0]


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


@pytest.mark.parametrize("width", [16, 32])
def test_any_width_gives_the_same_bits(width: int) -> None:
    random = np.random.default_rng(1)
    depths = np.concatenate([[0, 1e-30, 80, 1e9], 10 ** random.uniform(-8, 3, 1020)])
    bases = np.append(random.random(1020), [0, 1, 1.0001, 1e-38]).astype(np.float32)
    found = []
    for opacities, powers in (kernels(width), (OPACITIES, POWERS)):
        out = np.zeros((8, 1024), np.float32)
        opacities(depths.astype(np.float32), out[0])
        for k, exponent in enumerate((0, 0.5, 1, 3, 16, 127, 300)):
            powers(bases, np.float32(exponent), out[1 + k])
        found.append(out.tobytes())
    assert found[0] == found[1]
