"""How wide the ways of the default head are, measured with balls on a fine grid."""

import numpy as np
import pytest

from anatomy.phantom.parameters import PhantomParameters
from anatomy.phantom.phantom import Phantom
from anatomy.tissue import Side
from benchmarks.phantom_figures.passage_widths import (
    cell_diameters_mm,
    entrance_radii_mm,
    half_head,
    nearest_mm,
    ostium_diameters_mm,
    voxel_at,
)

SIDES = [
    pytest.param(Side.RIGHT, id="right"),
    pytest.param(Side.LEFT, id="left", marks=pytest.mark.slow),
]


@pytest.fixture(scope="module", params=SIDES)
def half(request: pytest.FixtureRequest) -> tuple[Phantom, Side]:
    """One side of the nose with what drains into it, and the side."""
    side: Side = request.param
    return half_head(PhantomParameters(), side), side


def test_ways_of_a_decongested_nose_are_wide_enough(half: tuple[Phantom, Side]) -> None:
    radii = entrance_radii_mm(*half)
    assert radii["choana"] > 2.2
    assert radii["middle meatus"] >= 2.0


def test_ostia_have_published_diameters(half: tuple[Phantom, Side]) -> None:
    found = ostium_diameters_mm(*half)
    # behind the ostium the way leads through the infundibulum, a slit of 1 to 3 mm
    assert 1.0 <= found["maxillary"] <= 3.0
    phantom, side = half
    mark = phantom.landmarks[f"maxillary ostium, {side.name.lower()}"]
    lateral = np.array([-1.0 if side == Side.RIGHT else 1.0, 0.0, 0.0])
    ostium = voxel_at(phantom, mark.position_mm + 1.5 * lateral)
    assert 3.0 <= -2.0 * phantom.distance.values[ostium] <= 5.0
    assert 2.0 <= found["sphenoid"] <= 4.5
    assert 2.0 <= found["frontal"] <= 6.0


def test_scopes_come_as_near_to_ostia_as_in_an_unoperated_nose(
    half: tuple[Phantom, Side],
) -> None:
    # The front of a scope is taken for a ball. A 4 mm scope sees the recess from
    # afar; a 2.7 mm scope comes to the ostium. No way at all would be infinity.
    assert 4.0 < nearest_mm(*half, "maxillary", 4.0) < 50.0
    assert 8.0 < nearest_mm(*half, "sphenoid", 4.0) < 50.0
    assert nearest_mm(*half, "sphenoid", 2.7) < 1.0


@pytest.mark.parametrize("side", SIDES)
def test_ethmoid_cells_have_ostia_of_one_to_three_millimetres(side: Side) -> None:
    found = cell_diameters_mm(PhantomParameters(), side)
    assert len(found) == 11
    assert min(found) >= 1.4
    assert max(found) <= 3.0
