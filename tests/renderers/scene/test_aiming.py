"""Axes from two places and an up, and what is done where up tells nothing."""

import warnings

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from numpy.typing import NDArray

from renderers.scene import Camera, UpWarning
from renderers.scene.aiming import aimed

EYE = (1.0, 2.0, 3.0)
WAY = st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda way: np.linalg.norm(way) > 1e-3)


def is_a_frame(frame: NDArray[np.float64]) -> bool:
    _, right, up, forward = frame
    products = frame[1:] @ frame[1:].T
    left_handed = np.allclose(np.cross(right, forward), up, atol=1e-12)
    return left_handed and np.allclose(products, np.eye(3), atol=1e-12)


@given(WAY, st.floats(1e-3, 1e3), st.booleans())
def test_an_up_along_the_view_gives_way_to_the_axis_least_aligned(
    way: tuple[float, float, float], size: float, back: bool
) -> None:
    """Told once a place, and the same picture every time."""
    forward = np.array(way) / np.linalg.norm(way)
    up = forward * (-size if back else size)
    with pytest.warns(UpWarning, match="parallel to the view"):
        frame = aimed(EYE, EYE + 5 * forward, up)
    assert is_a_frame(frame)
    axis = np.eye(3)[np.abs(frame[3]).argmin()]
    assert frame[2] @ axis > 0.8
    assert abs(frame[1] @ axis) < 1e-12
    with pytest.warns(UpWarning):
        assert_array_equal(aimed(EYE, EYE + 5 * forward, up), frame)


@given(st.floats(2e-6, 1.5), st.floats(0, 6.3))
def test_any_other_up_is_taken_as_it_is(angle: float, turn: float) -> None:
    """However small the angle: right stays across both."""
    up = (np.sin(angle) * np.cos(turn), np.sin(angle) * np.sin(turn), np.cos(angle))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        frame = aimed(EYE, (1, 2, 9), up)
    assert is_a_frame(frame)
    assert_allclose(frame[2], (np.cos(turn), np.sin(turn), 0), atol=1e-9 / angle)


@given(WAY, WAY)
def test_what_was_right_stays_right(
    way: tuple[float, float, float], before: tuple[float, float, float]
) -> None:
    forward = np.array(way) / np.linalg.norm(way)
    right = np.array(before) / np.linalg.norm(before)
    across = right - (right @ forward) * forward
    with pytest.warns(UpWarning):
        frame = aimed(EYE, EYE + forward, forward, right)
    assert is_a_frame(frame)
    if np.linalg.norm(across) > 1e-5:
        expected = across / np.linalg.norm(across)
        assert_allclose(frame[1], expected, atol=1e-9)


@pytest.mark.parametrize("target", [EYE, (np.nan, 0, 0), (np.inf, 0, 0)])
def test_aiming_needs_two_places(target: tuple[float, float, float]) -> None:
    with pytest.raises(ValueError, match="cannot aim"):
        Camera.looking_at(EYE, target)


@pytest.mark.parametrize("up", [(0, 0, 0), (0, np.nan, 1), (0, np.inf, 0)])
def test_an_up_that_is_no_direction_is_refused(up: tuple[float, float, float]) -> None:
    with pytest.raises(ValueError, match="up must be a direction"):
        Camera.looking_at(EYE, (0, 0, 0), up=up)


def test_numbers_of_any_size_are_directions() -> None:
    huge = aimed(EYE, (1, 9, 3), (0, 1e300, 1e300))
    tiny = aimed(EYE, (1, 9, 3), (0, 1e-300, 1e-300))
    assert_allclose(huge, tiny, atol=1e-12)
