import numpy as np
import pytest

from anatomy.frame import lps_from_ras
from anatomy.hazard_volumes import FARTHEST_MM
from anatomy.phantom.ethmoid import ethmoid_block
from anatomy.phantom.fixed_shapes import SHAPES
from anatomy.phantom.parameters import PhantomParameters
from anatomy.phantom.phantom import Phantom, build_phantom, distance_at
from anatomy.queries.hazards import EXACT, hazard_distances, sample_hazards
from anatomy.tissue import AIR_LABELS, Label, Side

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


BOX = ((-24.0, 24.0), (4.0, 80.0), (16.0, 60.0))


@pytest.fixture(scope="module")
def head() -> Phantom:
    return build_phantom(PhantomParameters(), 0.5, field_mm=BOX)


@pytest.fixture(scope="module")
def measured(head: Phantom) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Return the model's distances at random places, the lesser of both sides."""
    low, size = head.ct.origin_mm, 0.5 * (np.array(head.ct.shape[::-1]) - 1)
    places = low + np.random.default_rng(1).uniform(0, 1, (20_000, 3)) * size
    sides = hazard_distances(head.parameters, places)
    names = head.hazards.names
    return {
        name: np.minimum(sides[f"{name}, right"], sides[f"{name}, left"])
        for name in names
    }, places


def test_interpolated_tubes_are_the_models(
    head: Phantom, measured: tuple[dict[str, np.ndarray], np.ndarray]
) -> None:
    exact, places = measured
    for name in EXACT:
        near = (exact[name] > 0.5) & (exact[name] < FARTHEST_MM - 1.0)
        error = np.abs(head.hazards.distance_mm(name, places) - exact[name])[near]
        assert np.median(error) < 0.005, name
        assert np.percentile(error, 95) < 0.03, name


def test_other_surfaces_lie_where_the_model_has_them(
    head: Phantom, measured: tuple[dict[str, np.ndarray], np.ndarray]
) -> None:
    exact, places = measured
    for name in ("orbit", "skull base", "septum"):
        found = head.hazards.distance_mm(name, places)
        # beyond a tenth of a millimetre both say inside or outside alike
        clear = np.abs(found) > 0.1
        assert np.mean((found < 0)[clear] == (exact[name] < 0)[clear]) > 0.998, name
        close = np.abs(exact[name]) < 1.0
        assert np.median(np.abs(found - exact[name])[close]) < 0.02, name


def test_distances_change_no_faster_than_the_way(head: Phantom) -> None:
    for name, volume in head.hazards.volumes.items():
        steps = np.asarray(volume.values, np.int32)
        depth = head.distance.values
        for axis in range(3):
            change = np.abs(np.diff(steps, axis=axis)) * 0.01
            # air that a structure claims, too, is given to the air
            count = depth.shape[axis]
            ends = (range(1, count), range(count - 1))
            given = [np.take(depth, end, axis) < 0 for end in ends]
            change = change[~(given[0] | given[1])]
            assert np.percentile(change, 99.9) <= 0.5 * 1.06, name


def test_a_structure_is_within_its_own_hazard(head: Phantom) -> None:
    """Labels go by the largest share of a voxel: half a diagonal is their error."""
    for name, label in (
        ("optic nerve", Label.OPTIC_NERVE),
        ("internal carotid", Label.INTERNAL_CAROTID),
        ("vidian nerve", Label.VIDIAN_NERVE),
        ("maxillary nerve", Label.MAXILLARY_NERVE),
        ("sphenopalatine artery", Label.SPHENOPALATINE_ARTERY),
    ):
        inside = head.hazards.volumes[name].values[head.labels.values == label] * 0.01
        assert len(inside) > 20, name
        assert np.mean(inside < 0.0) > 0.9, name
        assert inside.max() < 0.45, name


def test_air_lies_in_no_hazard_and_threads_change_nothing(head: Phantom) -> None:
    air = head.distance.values < 0
    again = sample_hazards(head.parameters, head.distance, threads=2)
    for name, volume in head.hazards.volumes.items():
        assert (volume.values[air] >= 0).all(), name
        assert np.array_equal(volume.values, again.volumes[name].values), name
        assert volume.values.dtype == np.int16
        assert np.abs(volume.values).max() <= 2500


def test_the_skull_base_of_one_side_does_not_reach_into_the_other() -> None:
    """Over the left cells it is where it is over the right ones."""
    straight = PhantomParameters(septal_deviation_mm=0.0)
    right = np.array([[-9.0, 30.0, z] for z in (44.0, 47.0, 50.0)])
    found = hazard_distances(straight, right)
    mirrored = hazard_distances(straight, right * (-1.0, 1.0, 1.0))
    for side in ("left", "right"):
        name = f"skull base, {side}"
        assert mirrored[name] == pytest.approx(found[name], abs=1.0)
        assert (found[name][:2] > 1.0).all()
