"""Hazard distances on a grid are those of the model."""

import numpy as np
import pytest

from anatomy.hazard_volumes import FARTHEST_MM
from anatomy.phantom.parameters import PhantomParameters
from anatomy.phantom.phantom import Phantom, build_phantom
from anatomy.queries.hazard_sampling import sample_hazards
from anatomy.queries.hazards import EXACT, hazard_distances
from anatomy.tissue import Label

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
