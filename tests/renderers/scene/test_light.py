"""Laws of the lights."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from renderers.scene import Light, Scene, TransferFunction, Volume, four_lights


@given(st.lists(st.floats(-1e6, 1e6), min_size=3, max_size=3))
def test_an_infinite_light_keeps_only_its_direction(vector: list[float]) -> None:
    v = np.array(vector)
    if np.linalg.norm(v) < 1e-100:
        return
    light = Light(v, np.ones(3))
    assert np.linalg.norm(light.vector) == pytest.approx(1, rel=1e-12)
    np.testing.assert_allclose(
        np.cross(light.vector, v), 0, atol=1e-9 * np.abs(v).max()
    )
    assert light.vector @ v > 0


def test_a_local_light_keeps_its_place_even_at_the_origin() -> None:
    for place in ([0.0, 0, 0], [30.0, -2, 5]):
        light = Light(np.array(place), np.ones(3), is_local=True)
        assert np.array_equal(light.vector, place)


@given(seed=st.integers(0, 10**6))
def test_no_side_of_a_surface_is_black_under_four_lights(seed: int) -> None:
    # The largest of four cosines to a regular tetrahedron is at least 1/3.
    normal = np.random.default_rng(seed).normal(size=3)
    normal /= np.linalg.norm(normal)
    lights = four_lights()
    assert len(lights) == 4
    assert max(float(light.vector @ normal) for light in lights) >= 1 / 3 - 1e-12
    assert all(np.all(light.color > 0) for light in lights)


def test_four_lights_show_shape_and_burn_nothing() -> None:
    """A ball of mode `classic` is 2.5 times as bright on one side, white on none."""
    normals = np.random.default_rng(3).normal(size=(5000, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    volume = Volume(np.zeros((2, 2, 2), np.int16), np.ones(3), np.zeros(3))
    transfer = TransferFunction(np.array([0.0, 1]), np.ones((2, 3)), np.zeros(2))
    light = Scene(volume, transfer).diffuse_light(normals, normals)
    assert light.max() <= 1
    assert light.max() > 2.5 * light.min()


@pytest.mark.parametrize(
    ("vector", "color"),
    [
        ([0, 0, 0], [1, 1, 1]),
        ([0, 0, np.nan], [1, 1, 1]),
        ([0, 1], [1, 1, 1]),
        ([0, 0, 1], [1, -1, 1]),
        ([0, 0, 1], [1, np.inf, 1]),
        ([0, 0, 1], [1, 1]),
    ],
)
def test_bad_lights_are_refused(vector: list[float], color: list[float]) -> None:
    with pytest.raises(ValueError, match="light"):
        Light(np.array(vector), np.array(color))
