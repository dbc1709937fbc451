"""Bins with a user's node inside, lane by lane, against the transfer function."""

from typing import Any

import numpy as np
import pytest
from numba import njit

from renderers.art.classification import classification
from renderers.art.kernels.classify import classify
from renderers.lanes import load, store
from renderers.scene import TransferFunction

WIDTH = 16


@njit
def classify_all(table: Any, v: Any, out: Any) -> None:
    for i in range(0, len(v), WIDTH):
        x = load(v, i, WIDTH)
        found = classify(
            table.lines, table.first, table.extinction, table.color, table.color_slope,
            (table.low, table.scale, table.last), x, x == x,
        )  # fmt: skip
        store(out, i, found[0])
        store(out, len(v) + i, found[1])
        store(out, 2 * len(v) + i, found[2])
        store(out, 3 * len(v) + i, found[3])


def test_nodes_are_found_wherever_bins_begin() -> None:
    nodes = np.array([-700.3, -20.0, -19.99, 333.1, 333.11, 1250.7])
    rng = np.random.default_rng(0)
    transfer = TransferFunction(nodes, rng.random((6, 3)), rng.random(6))
    tried = np.concatenate([nodes, nodes + 0.004, rng.uniform(-900, 1500, 52)])
    v = tried.astype(np.float32)
    out = np.zeros((4, len(v)), np.float32)
    classify_all(classification(transfer), v, out)
    color, kappa = transfer.evaluate(v.astype(np.float64))
    # Float32 cuts a jump of .01 into steps of 1/1000.
    assert out[0] == pytest.approx(kappa, abs=5e-3)
    found = out[1:].T
    assert found == pytest.approx(color, abs=5e-3)
