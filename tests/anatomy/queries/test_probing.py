import numpy as np
import pytest

from anatomy.phantom.parameters import PhantomParameters
from anatomy.phantom.phantom import Phantom
from anatomy.queries.landmarks import landmarks
from anatomy.queries.probing import tissue_at
from anatomy.tissue import Label


def test_the_model_agrees_with_the_volume_made_from_it(phantom: Phantom) -> None:
    rng = np.random.default_rng(0)
    index = rng.integers(1, np.array(phantom.ct.shape) - 1, (1500, 3))
    points = phantom.ct.origin_mm + phantom.spacing_mm * index[:, ::-1]
    sample = tissue_at(phantom.parameters, points)
    at = tuple(index.T)
    distance = phantom.distance.values[at]
    clear = np.abs(distance) > 1.5
    same = sample.label == phantom.labels.values[at]
    assert same[clear].mean() > 0.98
    near = np.abs(distance) < 1.0
    assert np.median(np.abs(sample.distance_mm - distance)[near]) < 0.1
    assert np.median(np.abs(sample.hu - phantom.ct.values[at])[~near]) < 15


def test_normals_point_towards_the_air() -> None:
    head = PhantomParameters(unevenness=0.0)
    marks = landmarks(head)
    start = marks["choana, left"].position_mm
    lateral = start + np.array([5.5, 0.0, 0.0])
    sample = tissue_at(head, lateral)
    assert sample.normal.shape == (3,)
    assert sample.normal[0] < -0.5


def test_hazards_are_named() -> None:
    sample = tissue_at(PhantomParameters(), np.array([[17.0, 47.0, 42.0]]))
    assert sample.hazard[0] == "optic nerve, left"
    assert sample.hazard_mm[0] < 0
    assert sample.label[0] == Label.OPTIC_NERVE


def test_points_of_the_wrong_shape_are_refused() -> None:
    with pytest.raises(ValueError, match=r"shape \(\.\.\., 3\)"):
        tissue_at(PhantomParameters(), np.zeros((2, 2)))
