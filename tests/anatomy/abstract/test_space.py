"""Laws of a sampled space: distance, CT, labels and tint tell of one surface."""

import numpy as np
import pytest

from anatomy.abstract import LABELS, SCENES, AbstractSpace, build_scene
from anatomy.abstract.scenes import draw_layout
from anatomy.abstract.space import DARK, PLAIN
from anatomy.redistance import DEEPEST_MM, FARTHEST_MM
from anatomy.tissue import TISSUE_OF, Label
from renderers.shading.strands import LEAST_SKIN
from system import UserError


@pytest.fixture(scope="module", params=SCENES)
def named(request: pytest.FixtureRequest) -> tuple[str, AbstractSpace]:
    """Return a scene with its name."""
    return request.param, build_scene(request.param, 2, 0.8)


def test_the_grid_holds_the_exact_distance(named: tuple[str, AbstractSpace]) -> None:
    name, space = named
    volume = space.distance
    draw = np.random.default_rng(0)
    index = draw.integers(0, volume.shape[::-1], (500, 3))
    places = volume.origin_mm + index * volume.spacing_mm
    exact = draw_layout(name, 1).distance_mm(*places.T)
    i, j, k = index.T
    assert volume.values[k, j, i] == pytest.approx(
        np.clip(exact, DEEPEST_MM, FARTHEST_MM), abs=1e-5
    )


def test_the_distance_has_unit_slope_and_is_that_to_the_surface(
    named: tuple[str, AbstractSpace],
) -> None:
    layout = draw_layout(named[0], 1)
    draw = np.random.default_rng(1)
    places = draw.uniform(layout.low + 1.0, layout.high - 1.0, (2000, 3))
    distance = layout.distance_mm(*places.T)
    step = 1e-5
    slope = np.stack(
        [
            layout.distance_mm(*(places + step * axis).T)
            - layout.distance_mm(*(places - step * axis).T)
            for axis in np.eye(3)
        ],
        axis=1,
    ) / (2 * step)
    steep = np.linalg.norm(slope, axis=1)
    # but where two walls are equally near
    smooth = np.abs(steep - 1.0) < 1e-4
    assert smooth.mean() > 0.98
    assert steep.max() < 1.0 + 1e-4
    nearest = places[smooth] - distance[smooth, None] * slope[smooth]
    assert np.abs(layout.distance_mm(*nearest.T)).max() < 1e-3


def test_labels_ct_and_sign_agree(named: tuple[str, AbstractSpace]) -> None:
    _, space = named
    distance, labels = space.distance.values, space.labels.values
    assert np.array_equal(labels == Label.NASAL_AIR, distance < 0.0)
    assert set(np.unique(labels)) <= {Label.NASAL_AIR, *LABELS}
    far = np.abs(distance) >= space.distance.spacing_mm[0] / 2
    assert np.all(space.ct.values[far & (distance < 0)] == -1000)
    for label in LABELS:
        here = far & (labels == label)
        assert np.all(space.ct.values[here] == TISSUE_OF[label].hu)
    has_hoops = bool(np.any(labels == Label.SEPTAL_CARTILAGE))
    assert has_hoops == any(key[-1].isdigit() for key in space.landmarks)


def test_hoops_are_dark_walls_are_dry_and_grow_no_hair(
    named: tuple[str, AbstractSpace],
) -> None:
    _, space = named
    assert np.all(space.blood.values[space.labels.values == 14] == DARK)
    assert space.skin.values.max() <= PLAIN < 255 * LEAST_SKIN
    # most of what is seen is bare wall
    near = np.abs(space.distance.values) < 0.5
    near &= space.labels.values != Label.SEPTAL_CARTILAGE
    assert 0.5 < np.mean(space.blood.values[near] == 0) < 1.0


def test_the_way_in_is_free(named: tuple[str, AbstractSpace]) -> None:
    _, space = named
    way = space.way_in
    assert np.array_equal(way.pivot_mm, space.landmarks["start"])
    along = way.pivot_mm + np.arange(0, way.free_mm, 0.5)[:, None] * way.axis
    assert way.free_mm > 20.0
    assert space.distance.sample(along).max() < 0.0


@pytest.mark.parametrize("spacing_mm", [0.1, 1.5, float("nan")])
def test_a_foolish_spacing_is_refused(spacing_mm: float) -> None:
    with pytest.raises(UserError, match=r"must measure 0\.2 to 1 mm"):
        build_scene("niches", 1, spacing_mm)
