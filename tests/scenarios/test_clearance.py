import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from renderers.scene import Volume
from scenarios import shaft_clearance, tip_frame

RADIUS_MM = 6.0


def tube() -> Volume:
    """A straight round passage of 6 mm radius along y."""
    n, h = 41, 0.5
    axis = (np.arange(n) - n // 2) * h
    z, x = np.meshgrid(axis, axis, indexing="ij")
    field = np.repeat((np.hypot(x, z) - RADIUS_MM)[:, None, :], 81, axis=1)
    origin = np.array([axis[0], -20.0, axis[0]])
    return Volume(field.astype(np.float32), np.full(3, h), origin, background=5.0)


@given(st.floats(0, 3), st.floats(0, 2 * np.pi), st.floats(0.5, 2.0))
def test_parallel_shaft_in_a_round_tube(
    offset: float, turn: float, radius: float
) -> None:
    tip = np.array([offset * np.cos(turn), 5.0, offset * np.sin(turn)])
    frame = tip_frame(tip, np.array([0.0, 1.0, 0.0]))
    gap = shaft_clearance(tube(), frame, radius, 20.0).gap_mm
    # trilinear interpolation of a cone errs by h^2 / (8 r) at most, r taken at the
    # corner of the cell that is nearest to the axis, and by h / 2 on the axis itself
    nearest = max(offset - 0.5 * 2**0.5, 0.125)
    bound = 0.5**2 / 8 / nearest + 1e-6
    assert gap == pytest.approx(RADIUS_MM - offset - radius, abs=bound)


def test_tilted_shaft_touches_at_its_far_end() -> None:
    direction = np.array([0.2, 1.0, 0.0])
    frame = tip_frame(np.array([0.0, 18.0, 0.0]), direction)
    result = shaft_clearance(tube(), frame, 1.0, 30.0)
    back = -direction / np.linalg.norm(direction)
    far = np.array([0.0, 18.0, 0.0]) + 30.0 * back
    assert result.at_mm == pytest.approx(far, abs=0.26)
    assert result.gap_mm == pytest.approx(RADIUS_MM - abs(far[0]) - 1.0, abs=0.06)


def test_outside_the_field_is_air() -> None:
    frame = tip_frame(np.array([0.0, -60.0, 0.0]), np.array([0.0, 1.0, 0.0]))
    assert shaft_clearance(tube(), frame, 1.0, 30.0).gap_mm > 100.0


def test_a_tip_in_the_wall_is_reported_negative() -> None:
    frame = tip_frame(np.array([0.0, 0.0, 8.0]), np.array([0.0, 0.0, 1.0]))
    result = shaft_clearance(tube(), frame, 1.0, 10.0)
    assert result.gap_mm == pytest.approx(-(7.0 - RADIUS_MM) - 1.0, abs=0.05)
