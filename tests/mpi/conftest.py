"""What ranks draw."""

import pytest

from renderers.scene import Scene
from tests.scenes import rough_scene


@pytest.fixture(scope="session")
def scene() -> Scene:
    """Get noise seen through thin and thick extinction."""
    return rough_scene((30, 34, 38), (-9, -8, -12))
