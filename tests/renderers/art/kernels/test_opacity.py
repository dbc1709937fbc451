"""Vector functions against their scalar twins, bit by bit."""

from typing import Any

import numpy as np
from numba import njit

from renderers.art.kernels import opacity as vector
from renderers.art.kernels import opacity_scalar as scalar
from renderers.lanes import load, store

WIDTH = 16


@njit
def opacities(x: Any, out: Any) -> None:
    for i in range(0, len(x), WIDTH):
        store(out, i, vector.opacity(load(x, i, WIDTH)))


@njit
def powers(x: Any, exponent: Any, out: Any) -> None:
    for i in range(0, len(x), WIDTH):
        store(out, i, vector.power(load(x, i, WIDTH), exponent))


def test_opacity() -> None:
    rng = np.random.default_rng(1)
    x = np.concatenate([[0, 1e-30, 80, 1e9], 10 ** rng.uniform(-8, 3, 1020)])
    x = x.astype(np.float32)
    out = np.zeros_like(x)
    opacities(x, out)
    assert out.tolist() == [scalar.opacity(v) for v in x]


def test_power() -> None:
    x = np.append(np.random.default_rng(2).random(1020), [0, 1, 1.0001, 1e-38])
    x = x.astype(np.float32)
    out = np.zeros_like(x)
    for exponent in np.array([0, 0.5, 1, 3, 16, 127, 300], np.float32):
        powers(x, exponent, out)
        assert out.tolist() == [scalar.power(v, exponent) for v in x]
