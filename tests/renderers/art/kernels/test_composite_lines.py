"""Lines with closed forms."""

import numpy as np
import pytest

from renderers.art.classification import classification, sums_at_nodes
from renderers.art.kernels.composite_lines import LineArrays, composite_lines
from renderers.scene import TransferFunction

UNIFORM = TransferFunction(
    np.array([0.0, 1.0]), np.full((2, 3), 0.25), np.array([0.8, 0.8])
)


def light(
    values: np.ndarray[tuple[int, ...], np.dtype[np.float32]],
    transfer: TransferFunction,
    length_mm: float,
    step_mm: float,
    cutoff: float = 0.0,
) -> list[float]:
    """Cast one line along z, half a millimetre a voxel, from the first slice."""
    found = np.zeros((1, 4))
    table = classification(transfer)
    values.flags.writeable = False
    composite_lines(
        values,
        LineArrays(
            np.array([[1.0, 1.0, 0.0]]),
            np.array([[0.0, 0.0, 2.0]]),
            np.array([length_mm]),
        ),
        step_mm, cutoff, table, sums_at_nodes(table), found,
    )  # fmt: skip
    opacity: list[float] = found[0].tolist()
    return opacity


def test_a_uniform_medium_at_any_step() -> None:
    """Scene A1; the last step is as long as is left."""
    values = np.zeros((7, 3, 3), np.float32)
    exact = -np.expm1(-0.8 * 3)
    for step in (10.0, 1.0, 0.7, 0.1):
        found = light(values, UNIFORM, 3.0, step)
        assert found == pytest.approx([exact / 4] * 3 + [exact], rel=1e-6)


def test_a_ramp_through_a_step_of_the_transfer_function() -> None:
    """Scene S6: extinction .03, then .3, from 10.3 on; colour .8, then .2."""
    values = np.zeros((65, 3, 3), np.float32) + np.arange(65)[:, None, None] / 2
    jump = TransferFunction(
        np.array([10.3 - 1e-6, 10.3]),
        np.array([[0.8] * 3, [0.2] * 3]),
        np.array([0.03, 0.3]),
    )
    for step in (2.0, 0.5):
        found = light(values.astype(np.float32), jump, 32.0, step)
        assert found[0] == pytest.approx(0.359272975346393, abs=2e-6)
        assert found[3] == pytest.approx(0.998907186810756, abs=1e-6)


def test_a_line_ends_where_little_is_left_and_where_a_number_is_missing() -> None:
    values = np.zeros((7, 3, 3), np.float32)
    whole, cut = light(values, UNIFORM, 3.0, 0.1), light(values, UNIFORM, 3.0, 0.1, 0.3)
    assert 0 < whole[3] - cut[3] < 0.3
    values = np.zeros((7, 3, 3), np.float32)
    values[3:] = np.nan
    some = light(values, UNIFORM, 3.0, 0.1)
    assert 0 < some[3] < -np.expm1(-0.8 * 1.5)
    assert light(np.full((7, 3, 3), np.inf, np.float32), UNIFORM, 3.0, 0.1) == [0.0] * 4
