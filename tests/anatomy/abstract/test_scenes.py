"""Laws of the scenes: what must be reached can be, and seeds vary them."""

import numpy as np
import pytest

from anatomy.abstract import SCENES, AbstractSpace, build_scene
from anatomy.abstract.layout import PAST_MM
from anatomy.abstract.scenes import draw_layout
from scenarios.clearance import shaft_clearance
from scenarios.endoscope import tip_frame
from scenarios.tasks.rules import is_in_sight
from system import UserError

COARSE_MM = 1.0
SEEDS = [1, pytest.param(8, marks=pytest.mark.slow)]


@pytest.mark.parametrize("name", SCENES)
def test_a_seed_gives_the_same_space_and_another_seed_another(name: str) -> None:
    spaces = [build_scene(name, seed, COARSE_MM) for seed in (4, 4, 6)]
    for volume in ("ct", "labels", "distance", "blood", "skin"):
        first, again, other = (getattr(s, volume).values for s in spaces)
        assert first.tobytes() == again.tobytes()
    first, again, other = (s.landmarks for s in spaces)
    assert first.keys() == other.keys()
    moved = [np.linalg.norm(first[key] - other[key]) for key in first]
    assert max(moved) > 1.0
    assert all(np.array_equal(first[key], again[key]) for key in first)


@pytest.mark.parametrize("name", SCENES)
def test_an_odd_seed_is_the_even_one_in_a_mirror(name: str) -> None:
    here, there = (build_scene(name, seed, COARSE_MM) for seed in (2, 3))
    for volume in ("ct", "labels", "distance"):
        mirrored = getattr(there, volume).values[:, :, ::-1]
        assert np.array_equal(getattr(here, volume).values, mirrored)
    for key, place in here.landmarks.items():
        assert there.landmarks[key] == pytest.approx(place * [-1, 1, 1], abs=0)


@pytest.mark.parametrize("name", ["hoops", "path"])
@pytest.mark.parametrize("seed", SEEDS)
def test_a_thick_scope_reaches_through_every_hoop_untouched(
    name: str, seed: int
) -> None:
    space, layout = build_scene(name, seed), draw_layout(name, seed // 2)
    assert len(layout.hoops) >= 5
    marks = [m for key, m in space.landmarks.items() if key[-1].isdigit()]
    for mark, hoop in zip(marks, layout.hoops, strict=True):
        # the middle of the hole is in air, as wide as the hole
        assert layout.distance_mm(*hoop.middle) == pytest.approx(-hoop.opening_mm)
        # of which interpolation takes a part: the distance has a peak there
        assert float(space.distance.sample(mark)) < 0.5 - hoop.opening_mm
        for radius_mm in (1.35, 2.0):
            assert _gap_mm(space, mark, radius_mm, PAST_MM) > 0.2


@pytest.mark.parametrize("seed", SEEDS)
def test_every_target_lies_on_a_wall_and_a_straight_scope_can_centre_it(
    seed: int,
) -> None:
    space = build_scene("targets", seed)
    marks = {k: m for k, m in space.landmarks.items() if k.startswith("target")}
    assert sorted(marks) == [f"target {letter}" for letter in "ABCDEFGH"]
    for mark in marks.values():
        assert float(space.distance.sample(mark)) == pytest.approx(0.0, abs=0.05)
        assert is_in_sight(space.distance, space.landmarks["start"], mark)
        assert _gap_mm(space, mark, 2.0, -12.0) > 0.2


@pytest.mark.parametrize("seed", SEEDS)
def test_niches_are_hidden_from_a_straight_scope_and_not_from_an_angled_one(
    seed: int,
) -> None:
    space = build_scene("niches", seed)
    start = space.landmarks["start"]
    across = np.linspace(-4.6, 4.6, 9)
    for key in (k for k in space.landmarks if k.startswith("target")):
        mark = space.landmarks[key]
        assert float(space.distance.sample(mark)) == pytest.approx(0.0, abs=0.05)
        steepest, flattest = 0.0, 90.0
        for y in np.arange(mark[1] - 25.0, mark[1] + 1.0, 1.0):
            for x, z in ((x, z) for x in across for z in across):
                tip = np.array([x, y, z])
                shaft = (tip - start) / np.linalg.norm(tip - start)
                way = mark - tip
                aside = np.degrees(np.arccos(way @ shaft / np.linalg.norm(way)))
                if aside > 50.0 or not is_in_sight(space.distance, tip, mark):
                    continue
                flattest = min(flattest, float(aside))
                steepest = max(steepest, float(aside))
        # far outside the middle of a straight picture, inside that of one of 30 deg
        assert flattest > 25.0
        assert steepest > 40.0
        assert flattest < 45.0


def test_an_unknown_scene_names_the_nearest() -> None:
    with pytest.raises(UserError, match="did you mean 'hoops'"):
        build_scene("hoop")
    with pytest.raises(UserError, match="must not be negative, got -1"):
        build_scene("hoops", -1)


def _gap_mm(
    space: AbstractSpace,
    place: np.ndarray[tuple[int], np.dtype[np.float64]],
    radius_mm: float,
    past_mm: float,
) -> float:
    """Return the least gap while a scope is pushed from its pivot to past a place."""
    start = space.landmarks["start"]
    way = place - start
    length = float(np.linalg.norm(way))
    return min(
        shaft_clearance(
            space.distance,
            tip_frame(start + share * way, way),
            radius_mm,
            max(share * length, 4.0),
        ).gap_mm
        for share in np.linspace(0.1, 1 + past_mm / length, 40)
    )
