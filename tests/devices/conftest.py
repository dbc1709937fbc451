"""A path that several device tests share."""

import numpy as np
import pytest
from numpy.typing import NDArray

from devices.recording.probe_path import ProbePath


def _unit(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    unit: NDArray[np.float64] = vectors / np.linalg.norm(
        vectors, axis=-1, keepdims=True
    )
    return unit


@pytest.fixture
def short_path() -> ProbePath:
    """A second of motion through a nose-sized region."""
    count = 101
    s = np.linspace(0.0, 1.0, count)
    one = np.ones(count)
    axis = _unit(np.stack((0.1 * np.sin(5 * s), one, 0.5 * np.sin(4 * s)), axis=1))
    tip = np.stack((8 + 3 * np.sin(3 * s), -60 + 20 * s, 10 + 8 * np.sin(3 * s)), 1)
    return ProbePath(
        name="short",
        t_s=s,
        tip_mm=tip,
        axis=axis,
        roll_deg=40.0 * np.sin(3.0 * s),
        instrument_tip_mm=tip + np.array((2.0, 0.0, -3.0)),
        instrument_axis=axis,
        buttons=np.zeros(count, dtype=np.int64),
    )
