"""Products added to numbers: one rounding or two."""

from fractions import Fraction
from typing import Any

import llvmlite.binding as llvm
import numpy as np
import pytest
from numba import njit
from numba.core.errors import TypingError

from renderers.lanes import fma, load, store

COUNT = 256


@njit
def _by_fours(x: Any, y: Any, z: Any, out: Any) -> None:
    for i in range(0, COUNT, 4):
        store(out, i, fma(load(x, i, 4), load(y, i, 4), load(z, i, 4)))


@njit
def _by_sixteens(x: Any, y: Any, z: Any, out: Any) -> None:
    for i in range(0, COUNT, 16):
        store(out, i, fma(load(x, i, 16), load(y, i, 16), load(z, i, 16)))


def numbers(dtype: Any, seed: int) -> Any:
    """Make terms of which the last all but cancels the product of the others."""
    rng = np.random.default_rng(seed)
    x, y = rng.normal(size=(2, COUNT)).astype(dtype)
    return x, y, (-x * y * (1 + rng.normal(size=COUNT) * 1e-6)).astype(dtype)


def rounds_once() -> bool:
    """Say whether code for this machine has products that are added to."""
    arm = llvm.get_process_triple().startswith("aarch64")
    return arm or bool(llvm.get_host_cpu_features().get("fma"))


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_a_product_is_rounded_as_the_processor_can(dtype: Any) -> None:
    """Once: what is given is the nearest number there is to the exact sum."""
    x, y, z = numbers(dtype, 3)
    out = np.zeros(COUNT, dtype)
    _by_fours(x, y, z, out)
    if not rounds_once():
        np.testing.assert_array_equal(out, x * y + z)
        return
    for a, b, c, found in zip(x, y, z, out, strict=True):
        exact = Fraction(float(a)) * Fraction(float(b)) + Fraction(float(c))
        off = abs(Fraction(float(found)) - exact)
        for beside in (np.nextafter(found, dtype(k)) for k in (-9, 9)):
            assert off <= abs(Fraction(float(beside)) - exact)
    assert np.any(out != x * y + z)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_any_width_has_the_same_bits(dtype: Any) -> None:
    x, y, z = numbers(dtype, 5)
    out, of_sixteens = np.zeros(COUNT, dtype), np.ones(COUNT, dtype)
    _by_fours(x, y, z, out)
    _by_sixteens(x, y, z, of_sixteens)
    np.testing.assert_array_equal(of_sixteens, out)


def test_vectors_of_two_types_are_refused() -> None:
    x, y, z = numbers(np.float32, 1)
    with pytest.raises(TypingError, match="fma"):
        _by_fours(x, y.astype(np.float64), z, np.zeros(COUNT))
