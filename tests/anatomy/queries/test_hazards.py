import numpy as np
import pytest

from anatomy.frame import lps_from_ras
from anatomy.phantom.ethmoid import ethmoid_block
from anatomy.phantom.fixed_shapes import SHAPES
from anatomy.phantom.parameters import PhantomParameters
from anatomy.phantom.phantom import Phantom, distance_at
from anatomy.queries.hazards import hazard_distances
from anatomy.tissue import AIR_LABELS, Side

STRAIGHT = PhantomParameters(septal_deviation_mm=0.0)


@pytest.mark.parametrize("scale", [1.0, 0.93])
@pytest.mark.parametrize(("side", "sign"), [("right", 1.0), ("left", -1.0)])
def test_tubes_are_exact(side: str, sign: float, scale: float) -> None:
    head = PhantomParameters(septal_deviation_mm=0.0, head_scale=scale)
    rng = np.random.default_rng(0)
    points = rng.uniform([2, -80, 20], [25, -40, 50], (300, 3))
    world = lps_from_ras(scale * points * [sign, 1, 1])
    found = hazard_distances(head, world)
    for name in ("optic nerve", "internal carotid"):
        exact = scale * SHAPES[name].evaluate(points.T)
        assert np.abs(found[f"{name}, {side}"] - exact).max() < 0.1


def test_the_laminas_nasal_face_is_a_wall_away_from_the_orbit() -> None:
    # From the middle of an ethmoid outwards until the mucosa ends: there the orbit is
    # behind mucosa and bone. The face of the model's block is the one without noise.
    block = ethmoid_block(STRAIGHT, Side.RIGHT)
    wall = STRAIGHT.mucosa_mm + STRAIGHT.cell_bone_mm
    for y, z in ((-30.0, 38.0), (-36.0, 40.0), (-40.0, 41.0)):
        u = np.linspace(9.0, 18.0, 4000)
        points = np.stack([u, np.full_like(u, y), np.full_like(u, z)])
        face = points[:, np.argmax(block.evaluate(points) > 0)]
        found = hazard_distances(STRAIGHT, lps_from_ras(face[None]))
        assert found["orbit, right"][0] == pytest.approx(wall, abs=0.1)


def test_air_is_in_no_structure(phantom: Phantom) -> None:
    # Posterior cells touch the optic nerve, frontal sinuses lie before the brain.
    index = np.argwhere(np.isin(phantom.labels.values, list(AIR_LABELS)))[::41]
    points = phantom.ct.origin_mm + phantom.spacing_mm * index[:, ::-1]
    depth = -distance_at(phantom.parameters, points)
    for name, distance in hazard_distances(phantom.parameters, points).items():
        inside = depth > 0
        assert np.all(distance[inside] >= depth[inside]), name


def test_structures_are_where_they_belong() -> None:
    inside = {
        "orbit, left": (31.0, 10.0, 38.0),
        "skull base, left": (20.0, 20.0, 66.0),
        "septum, right": (-0.5, 20.0, 20.0),
    }
    for name, place in inside.items():
        assert hazard_distances(STRAIGHT, np.array([place]))[name][0] < 0, name
    far = hazard_distances(STRAIGHT, np.array([[9.0, 28.0, 27.0]]))
    assert far["orbit, left"][0] > 2
    assert far["orbit, right"][0] > 15
    assert far["skull base, left"][0] > 15


def test_points_of_the_wrong_shape_are_refused() -> None:
    with pytest.raises(ValueError, match=r"shape \(\.\.\., 3\)"):
        hazard_distances(STRAIGHT, np.zeros(4))
