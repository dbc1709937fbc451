"""Walls are rated where there are any."""

import numpy as np
import pytest

from paravol.snapshots.head_scene import HeadScene
from paravol.snapshots.wall_confidence import rated_surface
from renderers.scene import AirSurface, Scene, TransferFunction, Volume


def test_a_scan_without_a_surface_is_refused_and_others_are_taken() -> None:
    values = np.zeros((4, 4, 4), np.float32)
    volume = Volume(values, np.ones(3), np.zeros(3))
    clear = TransferFunction(np.array([0.0, 1.0]), np.zeros((2, 3)), np.zeros(2))
    with pytest.raises(ValueError, match="paravol import"):
        rated_surface(HeadScene(Scene(volume, clear), ""))
    tint = Volume(values.astype(np.uint8), np.ones(3), np.zeros(3))
    surface = AirSurface(volume, tint, tint)
    assert (
        rated_surface(HeadScene(Scene(volume, clear, surface=surface), "")) is surface
    )
