"""Segments between two densities against quadrature and closed forms."""

import itertools
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numba import njit
from numpy.typing import NDArray

from renderers.art.classification import classification, sums_at_nodes
from renderers.art.kernels.segments import end_of, integrate
from renderers.scene import TransferFunction
from renderers.simd import full, load, store

F = np.float32


WIDTH = 8


@njit
def integrate_all(table: Any, sums: Any, v: Any, h: Any, found: Any) -> None:
    zero, length = full(F(0), WIDTH), full(h, WIDTH)
    bins = (table.low, table.scale, table.last)
    v0, v1 = load(v, 0, WIDTH), load(v, WIDTH, WIDTH)
    start = end_of(
        table.lines, table.first, table.extinction, table.color, table.color_slope,
        bins, v0, v0 == v0,
    )  # fmt: skip
    end = end_of(
        table.lines, table.first, table.extinction, table.color, table.color_slope,
        bins, v1, v1 == v1,
    )  # fmt: skip
    light = integrate(
        table.extinction, table.color, sums, length, v0 == v0, v0, start, v1, end, zero
    )
    store(found, 0, light[0])
    store(found, WIDTH, light[1])
    store(found, 2 * WIDTH, light[2])
    store(found, 3 * WIDTH, light[3])


def through(
    transfer: TransferFunction, v0: float, v1: float, h: float
) -> NDArray[np.float64]:
    """Give opacity and colour by the kernel; the same in every lane."""
    table = classification(transfer)
    ends = np.repeat(np.array([v0, v1], F), WIDTH)
    found = np.zeros((4, WIDTH), F)
    integrate_all(table, sums_at_nodes(table), ends, F(h), found)
    # a segment without opacity has no colour
    lanes = np.repeat(found[:, :1], WIDTH, axis=1)
    assert np.array_equal(found, lanes, equal_nan=True)
    return found[:, 0].astype(np.float64)


def summed(
    transfer: TransferFunction, v0: float, v1: float, h: float
) -> NDArray[np.float64]:
    """Give them by Gauss's rule in float64, from node to node."""
    v0, v1 = float(F(v0)), float(F(v1))
    nodes = transfer.nodes
    cuts = nodes[(nodes > min(v0, v1)) & (nodes < max(v0, v1))]
    at = np.concatenate([[v0], cuts if v1 > v0 else cuts[::-1], [v1]])
    t, w = np.polynomial.legendre.leggauss(16)
    depth, light = 0.0, np.zeros(3)
    for a, b in itertools.pairwise(at):
        length = h * abs((b - a) / (v1 - v0)) if v1 != v0 else h
        # steep pieces need parts
        for k in range(32):
            low, part = a + (b - a) * k / 32, (b - a) / 32
            color, kappa = transfer.evaluate(low + part * (t + 1) / 2)
            tau = kappa @ w / 2 * length / 32
            inner = [
                transfer.evaluate(low + part * u / 2 * (t + 1) / 2)[1] @ w / 2 * u / 2
                for u in t + 1
            ]
            clear = np.exp(-depth - np.array(inner) * length / 32)
            light += (kappa * clear * w / 2) @ color * length / 32
            depth += float(tau)
    alpha = -math.expm1(-depth)
    return np.array([alpha, *(light / alpha if alpha else light)])


DENSITIES = st.floats(-1200, 1700)


@st.composite
def transfers(draw: st.DrawFn) -> TransferFunction:
    """Make a few nodes, some near to each other, some pieces clear."""
    n = draw(st.integers(2, 7))
    gaps = draw(st.lists(st.sampled_from([0.5, 3, 40, 300]), min_size=n, max_size=n))
    kappa = draw(st.lists(st.sampled_from([0, 0, 0.1, 2, 9]), min_size=n, max_size=n))
    colors = draw(st.lists(st.floats(0, 1), min_size=3 * n, max_size=3 * n))
    nodes = draw(st.sampled_from([-900.0, 0.0, 77.7])) + np.cumsum(gaps)
    return TransferFunction(
        nodes, np.reshape(colors, (n, 3)), np.array(kappa, dtype=float)
    )


@given(transfer=transfers(), v0=DENSITIES, v1=DENSITIES, h=st.sampled_from([0.02, 0.5]))
def test_optical_depth_is_exact_and_colour_between_what_is_passed(
    transfer: TransferFunction, v0: float, v1: float, h: float
) -> None:
    alpha, *color = through(transfer, v0, v1, h)
    wanted, *shades = summed(transfer, v0, v1, h)
    assert alpha == pytest.approx(wanted, rel=1e-5, abs=1e-7)
    if wanted > 1e-5:
        inside = (transfer.nodes > min(v0, v1)) & (transfer.nodes < max(v0, v1))
        ends, _ = transfer.evaluate(np.array([v0, v1]))
        passed = np.vstack([ends, transfer.color[inside]])
        assert np.all(np.array(color) > passed.min(axis=0) - 1e-5)
        assert np.all(np.array(color) < passed.max(axis=0) + 1e-5)
        # what hides what within a thin segment is of second order
        depth = -math.log1p(-min(wanted, 0.999999))
        assert np.abs(np.array(color) - shades).max() < 0.5 * depth + 1e-4


@given(
    v0=st.floats(-3000, -1, width=32),
    v1=st.floats(-3000, -1, width=32),
    far=st.booleans(),
)
def test_what_is_clear_is_exactly_clear(v0: float, v1: float, far: bool) -> None:
    """Also over nodes that change nothing but the colour, and beyond dense ones."""
    nodes = np.array([-900.0, -40.25, -10.0, 0.0, 5.0, 9.0, 2000.0])
    kappa = np.array([0.0, 0, 0, 0, 1000, 0, 0])
    transfer = TransferFunction(nodes, np.random.default_rng(1).random((7, 3)), kappa)
    if far:
        v0, v1 = 10 - v0, 10 - v1
    assert through(transfer, v0, v1, 4.0)[0] == 0
