import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from anatomy.phantom.lattice import DEFAULT_FIELD_MM, Lattice


@given(st.floats(0.2, 3.0))
def test_voxels_are_whole_multiples_inside_the_field(spacing: float) -> None:
    lattice = Lattice.covering(spacing, DEFAULT_FIELD_MM)
    for axis, (low, high) in enumerate(DEFAULT_FIELD_MM):
        first = lattice.first[axis] * spacing
        last = (lattice.first[axis] + lattice.count[axis] - 1) * spacing
        assert low - 1e-6 <= first < low + spacing
        assert high - spacing < last <= high + 1e-6


def test_the_default_field_is_small_enough_for_the_default_voxel() -> None:
    lattice = Lattice.covering(0.5, DEFAULT_FIELD_MM)
    assert np.prod(lattice.shape) < 7e6
    assert np.array_equal(lattice.origin_mm, [-41, -23, -12])


def test_an_empty_field_is_refused() -> None:
    with pytest.raises(ValueError, match="fewer than two voxels"):
        Lattice.covering(1.0, ((0.0, 0.5), (0.0, 9.0), (0.0, 9.0)))
