import numpy as np
import pytest

from anatomy.phantom.parts import healthy_parts
from anatomy.phantom.population import draw_parameters
from anatomy.tissue import Side


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("side", [Side.RIGHT, Side.LEFT])
def test_the_bullas_face_is_a_wall(seed: int, side: Side) -> None:
    """Two mucosae and a bone part it from infundibulum at any place."""
    parameters = draw_parameters(seed)
    parts = {part.name: part for part in healthy_parts(parameters, side)}
    rng = np.random.default_rng(seed)
    points = rng.uniform([5, -36, 18], [16, -14, 40], (20_000, 3)).T
    cells = parts["anterior ethmoid"]
    way = parts["infundibulum"]
    lining = cells.wall.mucosa_mm + way.wall.mucosa_mm
    between = cells.field.evaluate(points) + way.field.evaluate(points)
    assert between.min() > lining + cells.wall.bone_mm - 1e-6
