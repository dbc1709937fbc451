"""Whoever flew a way passes the hoops and stops that are made of it."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from renderers.scene import Camera, Volume
from scenarios.path_course import (
    NARROWEST_MM,
    STOP_MM,
    STRAIGHT_MM,
    WIDEST_MM,
    course_tasks,
    score_clock_s,
)
from scenarios.tasks import Situation, TaskEngine
from scenarios.tasks.engine import Status
from scenarios.tasks.task import Follow, Reach, Ring, Task
from system import UserError

EVERY_S = 0.02


def tube(radius_mm: float = 3.0) -> Volume:
    """Make a straight tube of air along z, through the origin, walls outside."""
    count = np.array([41, 41, 41])
    spacing = np.full(3, 1.0)
    origin = -spacing * (count - 1) / 2
    x, y = np.meshgrid(*[np.arange(41) - 20.0] * 2, indexing="xy")
    away = np.hypot(x, y) - radius_mm
    values = np.broadcast_to(away, (41, 41, 41)).astype(np.float32).copy()
    return Volume(values, spacing, origin, np.eye(3), 1000.0)


def flown(
    tasks: tuple[Task, ...], time_s: NDArray[np.float64], tip_mm: NDArray[np.float64]
) -> TaskEngine:
    """Give the tasks to the engine, and the way."""
    engine, distance = TaskEngine(tasks, {}), tube()
    camera = Camera(np.vstack([np.zeros(3), np.eye(3)]), 0.5, 8, 8)
    for at_s, tip in zip(time_s, tip_mm, strict=True):
        engine.step(Situation(float(at_s), tip, camera, distance))
    return engine


def times(count: int) -> NDArray[np.float64]:
    """Give the times of evenly spaced samples."""
    return np.linspace(0.0, EVERY_S * (count - 1), count)


def middle(task: Ring | Reach) -> NDArray[np.float64]:
    """Give the place of a hoop or stop."""
    assert not isinstance(task.place, str)
    return np.array(task.place)


def all_rings(tasks: tuple[Task, ...]) -> list[Ring]:
    return [r for task in tasks if isinstance(task, Follow) for r in task.rings]


def test_a_straight_way_has_hoops_at_even_distances_facing_along_it() -> None:
    z = np.arange(-18.0, 50.0, 0.1)
    tip = np.stack([0 * z, 0 * z, z], axis=1)
    tasks = course_tasks(times(len(z)), tip, tube(3.0))
    assert [task.name for task in tasks] == ["course 1"]
    rings = all_rings(tasks)
    places = np.array([middle(ring) for ring in rings])
    np.testing.assert_allclose(np.diff(places[:, 2]), STRAIGHT_MM, atol=0.6)
    for ring in rings:
        np.testing.assert_allclose(ring.axis, (0.0, 0.0, 1.0), atol=1e-6)
    # as wide as the tube, within its grid; outside the field it is as for a wall
    inside = [ring.radius_mm for ring in rings if abs(middle(ring)[2]) < 19.0]
    assert inside == pytest.approx([3.0] * len(inside), abs=0.05)
    assert all(NARROWEST_MM <= r.radius_mm <= WIDEST_MM for r in rings)


def test_hoops_stand_closer_where_the_way_bends() -> None:
    """A circle of radius 10: a hoop for each 35 degrees and its share of the length."""
    angle = np.linspace(0.0, 2 * np.pi, 700)
    bent = 10.0 * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    time_s = times(len(angle))
    rings = all_rings(course_tasks(time_s, bent, tube()))
    places = np.array([middle(ring) for ring in rings])
    apart = np.linalg.norm(np.diff(places, axis=0), axis=1)
    # s / 12 mm + s / 10 mm in degrees / 35 = 1
    expected = 1.0 / (1 / STRAIGHT_MM + np.degrees(1 / 10.0) / 35.0)
    chord = 20.0 * np.sin(expected / 20.0)
    assert apart == pytest.approx(chord, abs=0.6)
    assert apart.max() < STRAIGHT_MM
    for ring in rings:
        tangent = np.array([-middle(ring)[1], middle(ring)[0], 0.0]) / 10.0
        assert np.array(ring.axis) @ tangent > np.cos(np.radians(8.0))


def test_stops_stand_where_the_tip_paused() -> None:
    out = np.linspace(0.0, 20.0, 200)
    z = np.concatenate([out, np.full(150, 20.0), 20.0 + out])
    tip = np.stack([0 * z, 0 * z, z - 20.0], axis=1)
    time_s = times(len(z))
    tasks = course_tasks(time_s, tip, tube())
    assert [task.name for task in tasks] == ["course 1", "stop 1", "course 2"]
    stop = tasks[1]
    assert isinstance(stop, Reach)
    np.testing.assert_allclose(middle(stop), np.zeros(3), atol=1.0)
    assert stop.radius_mm == STOP_MM
    assert 1.0 < stop.hold_s <= 2.0
    assert [task.after for task in tasks] == [(), ("course 1",), ("stop 1",)]
    assert flown(tasks, time_s, tip).is_complete
    # whoever does not stop does not pass
    hasty = flown(tasks, time_s[:400], tip[np.r_[:200, 350:550]])
    assert hasty.states[1].status is Status.OPEN


def test_the_way_backwards_does_not_pass() -> None:
    z = np.arange(-20.0, 20.0, 0.1)
    tip = np.stack([0 * z, 0 * z, z], axis=1)
    time_s = times(len(z))
    tasks = course_tasks(time_s, tip, tube())
    assert flown(tasks, time_s, tip).is_complete
    assert not flown(tasks, time_s, tip[::-1]).is_complete


@settings(max_examples=25)
@given(seed=st.integers(0, 2**32 - 1), noise_mm=st.sampled_from([0.0, 0.1, 0.3]))
def test_every_way_passes_its_own_course(seed: int, noise_mm: float) -> None:
    """Ways of random waves out and back, with pauses and an arm's shaking."""
    random = np.random.default_rng(seed)
    count = 900
    along = np.sin(np.linspace(0.0, np.pi, count)) * 60.0
    waves = sum(
        random.normal(size=3)
        * 3.0
        * np.sin(
            random.uniform(1, 9) * np.pi * np.linspace(0, 1, count)
            + random.uniform(0, 6)
        )[:, None]
        for _ in range(3)
    )
    way = np.asarray(waves) + along[:, None] * np.array([0.1, 0.2, 0.97])
    at = int(random.integers(50, count - 50))
    way = np.concatenate([way[:at], np.repeat(way[at][None], 120, 0), way[at:]])
    way = way + random.normal(scale=noise_mm, size=way.shape)
    time_s = times(len(way))
    tasks = course_tasks(time_s, way, tube())
    engine = flown(tasks, time_s, way)
    assert [s.name for s in engine.states if s.status is not Status.DONE] == []
    places = np.array([middle(ring) for ring in all_rings(tasks)])
    assert len(places) >= 4
    # hoops of one course are never on top of one another
    for task in tasks:
        if isinstance(task, Follow) and noise_mm == 0.0:
            own = np.array([middle(ring) for ring in task.rings])
            steps = np.linalg.norm(np.diff(own, axis=0), axis=1)
            assert (steps < 2 * STRAIGHT_MM).all() or len(own) < 3


def test_a_way_too_short_is_refused() -> None:
    tip = np.zeros((20, 3))
    with pytest.raises(UserError, match="too short"):
        course_tasks(times(20), tip, tube())


def test_the_scores_clock_stands_while_frozen() -> None:
    time_s = np.array([5.0, 6.0, 7.0, 9.0, 10.0])
    frozen = np.array([False, False, True, True, False])
    assert score_clock_s(time_s, frozen).tolist() == [0.0, 1.0, 1.0, 1.0, 1.0]
    nothing = np.zeros(5, bool)
    assert score_clock_s(time_s, nothing).tolist() == [0.0, 1.0, 2.0, 4.0, 5.0]
