import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from paravol.registration.skin import FRONT_MM, ROWS_MM, SIDES_MM, Skin
from renderers.scene import Volume

CENTRE = np.array([0.0, 60.0, 38.0])
RADIUS = 70.0


@pytest.fixture(scope="module")
def ball() -> Skin:
    """A ball for a head, in a field with steps of a millimetre."""
    origin = np.array([-45.0, -25.0, 0.0])
    z, y, x = np.meshgrid(
        np.arange(0.0, 80.0),
        np.arange(-25.0, 30.0),
        np.arange(-45.0, 46.0),
        indexing="ij",
    )
    off = np.sqrt((x - CENTRE[0]) ** 2 + (y - CENTRE[1]) ** 2 + (z - CENTRE[2]) ** 2)
    return Skin(Volume((RADIUS - off).astype(np.float32), np.ones(3), origin))


def test_the_raster_lies_on_the_skin(ball: Skin) -> None:
    raster = ball.raster()
    off = np.linalg.norm(raster - CENTRE, axis=1) - RADIUS
    assert np.abs(off).max() < 0.02
    assert set(raster[:, 2]) == set(ROWS_MM)
    assert raster[:, 0].min() == SIDES_MM[0]
    assert raster[:, 0].max() == SIDES_MM[1]
    assert (raster[:, 1] < FRONT_MM[1]).all()


def test_rows_are_drawn_to_and_fro(ball: Skin) -> None:
    raster = ball.raster()
    steps = np.linalg.norm(np.diff(raster, axis=0), axis=1)
    assert steps.max() < 15.0
    rows = [raster[raster[:, 2] == z][:, 0] for z in ROWS_MM]
    assert [bool(row[0] < row[-1]) for row in rows] == [True, False, True, False, True]


@given(st.floats(0.0, 3.0))
def test_a_dent_lies_along_the_normal(ball: Skin, dent_mm: float) -> None:
    raster, pressed = ball.raster(), ball.raster(dent_mm)
    inward = (CENTRE - raster) / np.linalg.norm(CENTRE - raster, axis=1)[:, None]
    np.testing.assert_allclose(pressed - raster, dent_mm * inward, atol=0.06)


def test_distance_and_normal_are_those_of_the_ball(ball: Skin) -> None:
    points = ball.raster() + np.array([0.0, -1.3, 0.4])
    out = points - CENTRE
    length = np.linalg.norm(out, axis=1)
    np.testing.assert_allclose(ball.distance(points), RADIUS - length, atol=0.02)
    np.testing.assert_allclose(ball.normal(points), -out / length[:, None], atol=0.02)


def test_outside_the_field_there_is_nothing_to_find(ball: Skin) -> None:
    far = np.array([[0.0, -300.0, 40.0]])
    assert ball.distance(far)[0] < 0.0
    np.testing.assert_array_equal(ball.normal(far), np.zeros((1, 3)))
