import numpy as np
import pytest
from numpy.typing import NDArray

from paravol.scoring.shortest_way import inside_of, shortest_way_mm
from renderers.scene import Volume

H = 0.5


def head(distance: NDArray[np.float64]) -> Volume:
    values = distance.astype(np.float32)
    return Volume(values, np.full(3, H), np.zeros(3), background=9.0)


def room(size: int = 41) -> tuple[NDArray[np.float64], ...]:
    return tuple(H * axis for axis in np.mgrid[:size, :size, :size].astype(float))


def test_free_air_is_crossed_straight() -> None:
    volume = head(np.full((41, 41, 41), -5.0))
    ways = np.array([[2.0, 2.0, 2.0], [17.0, 11.0, 5.0]])
    length = shortest_way_mm(volume, ways, 1.35)
    assert length == pytest.approx(np.linalg.norm(ways[1] - ways[0]), rel=1e-6)
    back = shortest_way_mm(volume, ways[[0, 1, 0]], 1.35)
    assert back == pytest.approx(2 * np.linalg.norm(ways[1] - ways[0]), rel=1e-6)


def test_a_ball_is_passed_along_tangents_and_its_surface() -> None:
    """Two tangents and the arc between them; the grid adds a few per cent."""
    z, y, x = room()
    away = np.sqrt((x - 10) ** 2 + (y - 10) ** 2 + (z - 10) ** 2)
    ball_mm, scope_mm = 4.0, 1.0
    volume = head(np.minimum(ball_mm - away, 5.0))
    kept = ball_mm + scope_mm
    half = 9.0
    expected = 2 * np.sqrt(half**2 - kept**2) + kept * (
        np.pi - 2 * np.arccos(kept / half)
    )
    ways = np.array([[1.0, 10.0, 10.0], [19.0, 10.0, 10.0]])
    length = shortest_way_mm(volume, ways, scope_mm)
    assert length is not None
    assert expected * 0.995 < length < expected * 1.06


def test_a_slit_narrower_than_the_scope_is_dented_and_a_wall_ends_the_way() -> None:
    z, y, x = room()
    slit = np.abs(y - 10.0) - 0.8
    ways = np.array([[2.0, 10.0, 10.0], [18.0, 10.0, 10.0]])
    assert shortest_way_mm(head(slit), ways, 1.35) == pytest.approx(16.0)
    walled = np.where(np.abs(x - 10.0) < 1.0, 2.0, -5.0)
    assert shortest_way_mm(head(walled), ways, 1.35) is None
    assert shortest_way_mm(head(np.abs(z) + 1.0), ways, 1.35) is None


def test_what_lies_on_the_grid_is_inside() -> None:
    volume = head(np.zeros((41, 41, 41)))
    points = np.array([[0.0, 0.0, 0.0], [20.0, 20.0, 20.0], [20.1, 1, 1], [-0.1, 1, 1]])
    assert inside_of(volume, points).tolist() == [True, True, False, False]
