"""What ranks draw."""

import numpy as np
import pytest

from renderers.scene import Scene, TransferFunction, Volume


@pytest.fixture(scope="session")
def scene() -> Scene:
    """Get noise seen through thin and thick extinction."""
    values = np.random.default_rng(4).integers(-300, 300, (30, 34, 38), np.int16)
    volume = Volume(values, np.array([0.5, 0.5, 0.8]), np.array([-9.0, -8, -12]))
    transfer = TransferFunction(
        np.array([0.0, 100, 300]),
        np.array([[1.0, 0.5, 0.2], [0.2, 0.9, 0.4], [1, 1, 1]]),
        np.array([0.0, 0.02, 0.5]),
    )
    return Scene(volume, transfer)
