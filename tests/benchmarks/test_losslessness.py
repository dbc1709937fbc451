"""Values are the same when their bits are."""

import numpy as np
import pytest
from numpy.typing import NDArray

from benchmarks.losslessness import differing


@pytest.mark.parametrize("kind", ["f4", "f8", "u1", "i2", "?"])
def test_only_other_bits_are_counted(kind: str) -> None:
    a = (np.arange(12) % 2).astype(kind).reshape(3, 4)
    b = a.copy()
    assert differing(a, b) == 0
    b[1, 2] = 1
    b[2, 0] = 1
    assert differing(a, b) == 2


def test_zeros_of_two_signs_differ_and_a_nan_is_itself() -> None:
    a = np.array([0.0, np.nan, 1.0], np.float32)
    b = np.array([-0.0, np.nan, np.nextafter(np.float32(1), np.float32(2))], np.float32)
    assert differing(a, a.copy()) == 0
    assert differing(a, b) == 2


def test_a_view_is_compared_by_its_values() -> None:
    a = np.arange(12.0).reshape(3, 4)
    assert differing(a[:, ::2], a[:, ::2].copy()) == 0
    assert differing(a[:, ::2], a[:, 1::2]) == 6


@pytest.mark.parametrize("other", [np.zeros(3), np.zeros(2, np.float32)])
def test_other_shapes_and_types_are_refused(other: NDArray[np.floating]) -> None:
    with pytest.raises(ValueError, match="cannot compare"):
        differing(np.zeros(2), other)
