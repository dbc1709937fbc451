"""Closed forms of extinction, opacity and the piecewise linear map."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from renderers.scene import TransferFunction, extinction_from_opacity
from renderers.scene.transfer import MAX_OPACITY

LENGTHS = st.floats(1e-3, 100)


def opacity(kappa: float, length_mm: float) -> float:
    """Give the opacity of a homogeneous segment."""
    return -math.expm1(-kappa * length_mm)


def example(seed: int = 3) -> TransferFunction:
    rng = np.random.default_rng(seed)
    nodes = np.cumsum(rng.uniform(0.5, 200, 6)) - 300
    kappa = rng.uniform(0, 3, 6) * rng.integers(0, 2, 6)
    return TransferFunction(nodes, rng.uniform(0, 1, (6, 3)), kappa)


@given(
    alpha=st.floats(1e-300, 0.99) | st.sampled_from([1e-20, 1e-9, 2.0**-24]),
    length=LENGTHS,
)
def test_opacity_survives_the_round_trip_however_small(
    alpha: float, length: float
) -> None:
    kappa = extinction_from_opacity(np.array(alpha), length)
    assert opacity(float(kappa), length) == pytest.approx(alpha, rel=1e-12, abs=0)


def test_an_opaque_segment_is_finite_and_an_empty_one_clear() -> None:
    kappa = extinction_from_opacity(np.array([0.0, 1.0]), 1.0)
    assert np.all(np.isfinite(kappa))
    assert kappa[0] == 0
    assert all(opacity(float(k), 0.0) == 0 for k in kappa)
    assert opacity(float(kappa[1]), 1.0) == pytest.approx(MAX_OPACITY, rel=1e-15)
    with pytest.raises(ValueError, match="positive"):
        extinction_from_opacity(np.array([0.5]), 0.0)


@given(seed=st.integers(0, 10**6), weight=st.floats(0, 1), segment=st.integers(0, 4))
def test_values_are_linear_between_nodes_and_constant_beyond(
    seed: int, weight: float, segment: int
) -> None:
    tf = example(seed)
    density = (1 - weight) * tf.nodes[segment] + weight * tf.nodes[segment + 1]
    color, kappa = tf.evaluate(np.array([density]))

    def between(v: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.asarray((1 - weight) * v[segment] + weight * v[segment + 1])

    np.testing.assert_allclose(color[0], between(tf.color), atol=1e-11)
    np.testing.assert_allclose(kappa[0], between(tf.kappa_per_mm), atol=1e-11)
    for end, density in ((0, tf.nodes[0] - 1e5), (-1, tf.nodes[-1] + 1e5)):
        color, kappa = tf.evaluate(np.array([density]))
        assert np.array_equal(color[0], tf.color[end])
        assert kappa[0] == tf.kappa_per_mm[end]


def test_table_rows_are_the_function_itself() -> None:
    tf = example()
    table = tf.table(-200.0, 310.0, 52)
    color, kappa = tf.evaluate(np.linspace(-200.0, 310.0, 52))
    assert table.dtype == np.float32
    assert table.shape == (52, 4)
    np.testing.assert_allclose(table[:, :3], color, rtol=1e-6)
    np.testing.assert_allclose(table[:, 3], kappa, rtol=1e-6)
    for low, high, size in ((5.0, 5.0, 8), (0.0, 1.0, 1), (1.0, 0.0, 8)):
        with pytest.raises(ValueError, match="cannot tabulate"):
            tf.table(low, high, size)


@given(seed=st.integers(0, 10**6), low=st.floats(-400, 900), width=st.floats(1e-3, 600))
def test_is_clear_is_neither_too_bold_nor_too_timid(
    seed: int, low: float, width: float
) -> None:
    tf, high = example(seed), low + width
    inside = tf.nodes[(tf.nodes > low) & (tf.nodes < high)]
    # A piecewise linear function >= 0 is zero on an interval exactly if it is zero at
    # the ends and at every node between them.
    probes = np.concatenate([np.linspace(low, high, 301), inside])
    assert tf.is_clear(low, high) == bool(np.all(tf.evaluate(probes)[1] == 0))


def test_from_opacity_is_the_conversion() -> None:
    nodes, color = np.array([0.0, 1, 2]), np.ones((3, 3))
    alpha = np.array([0.0, 1e-12, 0.5])
    tf = TransferFunction.from_opacity(nodes, color, alpha, 0.7)
    np.testing.assert_allclose(-np.expm1(-tf.kappa_per_mm * 0.7), alpha, rtol=1e-12)


def test_inputs_are_copied_and_frozen() -> None:
    nodes = np.array([0.0, 1.0])
    tf = TransferFunction(nodes, np.ones((2, 3)), np.ones(2))
    nodes[0] = 0.5
    assert tf.nodes[0] == 0.0
    for array in (tf.nodes, tf.color, tf.kappa_per_mm):
        assert not array.flags.writeable


@pytest.mark.parametrize(
    ("nodes", "color", "kappa"),
    [
        ([0.0] * 3, np.ones((3, 3)), np.ones(3)),
        ([1.0, 0.0], np.ones((2, 3)), np.ones(2)),
        ([0.0], np.ones((1, 3)), np.ones(1)),
        ([], np.ones((0, 3)), np.ones(0)),
        ([0.0, np.nan], np.ones((2, 3)), np.ones(2)),
        ([0.0, np.inf], np.ones((2, 3)), np.ones(2)),
        ([0.0, 1.0], np.ones((3, 3)), np.ones(2)),
        ([0.0, 1.0], np.ones((2, 3)), np.ones(3)),
        ([0.0, 1.0], np.ones((2, 3)), [0.0, -1.0]),
        ([0.0, 1.0], np.ones((2, 3)), [0.0, -1e-9]),
        ([0.0, 1.0], np.ones((2, 3)), [0.0, np.nan]),
        ([0.0, 1.0], np.ones((2, 3)), [0.0, np.inf]),
        ([0.0, 1.0], -np.ones((2, 3)), np.ones(2)),
    ],
)
def test_bad_functions_are_refused(
    nodes: list[float], color: NDArray[np.float64], kappa: NDArray[np.float64]
) -> None:
    with pytest.raises(ValueError, match=r"transfer function|nodes need"):
        TransferFunction(np.array(nodes), color, np.array(kappa))
