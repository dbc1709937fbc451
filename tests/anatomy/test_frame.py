import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from anatomy.frame import lps_from_ras

coordinate = st.floats(-1e3, 1e3)


@given(st.tuples(coordinate, coordinate, coordinate))
def test_the_conversion_is_its_own_inverse(point: tuple[float, float, float]) -> None:
    ras = np.array(point)
    assert np.array_equal(lps_from_ras(lps_from_ras(ras)), ras)


def test_right_front_up_becomes_its_lps_point() -> None:
    assert np.array_equal(lps_from_ras(np.array([1.0, 2.0, 3.0])), [-1, -2, 3])


def test_the_argument_is_left_alone() -> None:
    points = np.ones((2, 3))
    lps_from_ras(points)
    assert np.array_equal(points, np.ones((2, 3)))
