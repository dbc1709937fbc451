"""What a scene accepts."""

from typing import Any

import numpy as np
import pytest

from renderers.scene import AirSurface, Scene, TransferFunction, Volume


def volume(dtype: Any, shape: tuple[int, int, int] = (3, 4, 5)) -> Volume:
    return Volume(np.zeros(shape, dtype), np.ones(3), np.zeros(3))


def test_a_scene_without_air_has_four_lights_and_no_surface() -> None:
    clear = TransferFunction(np.array([0.0, 1]), np.ones((2, 3)), np.zeros(2))
    scene = Scene(volume(np.float32), clear)
    assert scene.surface is None
    assert len(scene.lights) == 4


def test_an_air_surface_is_one_grid_of_fixed_types() -> None:
    surface = AirSurface(volume(np.float32), volume(np.uint8), volume(np.uint8))
    assert surface.blood.shape == surface.distance.shape


@pytest.mark.parametrize(
    ("distance", "blood", "skin"),
    [
        (volume(np.float64), volume(np.uint8), volume(np.uint8)),
        (volume(np.float32), volume(np.float32), volume(np.uint8)),
        (volume(np.float32), volume(np.uint8), volume(np.int16)),
        (volume(np.float32), volume(np.uint8, (3, 4, 6)), volume(np.uint8)),
    ],
)
def test_other_types_or_shapes_are_refused(
    distance: Volume, blood: Volume, skin: Volume
) -> None:
    with pytest.raises(ValueError, match="must be"):
        AirSurface(distance, blood, skin)
