"""Products added to numbers, one by one and by vectors: one or two roundings."""

from fractions import Fraction
from typing import Any

import llvmlite.binding as llvm
import numpy as np
import pytest
from numba import njit
from numba.core.errors import TypingError

from renderers.lanes import load, store
from renderers.lanes import muladd as muladd_of_vectors
from renderers.lanes.fma import muladd

COUNT = 256


@njit
def _one_by_one(x: Any, y: Any, z: Any, out: Any) -> None:
    for i in range(x.size):
        out[i] = muladd(x[i], y[i], z[i])


@njit
def _by_vectors(x: Any, y: Any, z: Any, out: Any) -> None:
    for i in range(0, COUNT, 16):
        a, b, c = load(x, i, 16), load(y, i, 16), load(z, i, 16)
        store(out, i, muladd_of_vectors(a, b, c))


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
    _one_by_one(x, y, z, out)
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
def test_vectors_do_as_numbers_do(dtype: Any) -> None:
    x, y, z = numbers(dtype, 5)
    out, of_vectors = np.zeros(COUNT, dtype), np.ones(COUNT, dtype)
    _one_by_one(x, y, z, out)
    _by_vectors(x, y, z, of_vectors)
    np.testing.assert_array_equal(of_vectors, out)


def test_numbers_of_two_types_are_refused() -> None:
    x, y, z = numbers(np.float32, 1)
    with pytest.raises(TypingError, match="muladd"):
        _one_by_one(x, y.astype(np.float64), z, np.zeros(COUNT))
