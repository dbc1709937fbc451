from dataclasses import replace
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from anatomy.tissue import Label
from paravol.guide.goals import Goal, GuidedHead, goal_of, open_task
from renderers.scene import Volume
from scenarios.structures import Structures
from scenarios.tasks import Status, Task, TaskState
from scenarios.tasks.task import (
    Follow,
    Inject,
    KeepAway,
    Limits,
    Open,
    Reach,
    Remove,
    Ring,
    Share,
)

Place = NDArray[np.float64]

H = 0.5
SIZE = 41


def head() -> GuidedHead:
    """Two blocks of uncinate bone on both sides of a septum at x = 10, in air."""
    x = H * np.mgrid[:SIZE, :SIZE, :SIZE][2].astype(float)
    labels = np.zeros((SIZE,) * 3, np.uint8)
    distance = np.minimum(0.8 - np.abs(x - 10.0), 3.0)
    for low in (6, 30):
        labels[20:24, 20:24, low : low + 4] = Label.UNCINATE
        distance[20:24, 20:24, low : low + 4] = 0.5
    places = {
        "nostril, right": np.array([5.0, 0.0, 10.0]),
        "nostril, left": np.array([15.0, 0.0, 10.0]),
        "hoop 1": np.array([5.0, 8.0, 10.0]),
        "hoop 2": np.array([5.0, 15.0, 10.0]),
    }
    spacing, origin = np.full(3, H), np.zeros(3)
    air = Volume(distance.astype(np.float32), spacing, origin, background=9.0)
    marks = Volume(labels, spacing, origin, background=0)
    names = {int(Label.UNCINATE): "uncinate"}
    named = Structures.of(air, marks, names, MappingProxyType(places))
    return GuidedHead(air, places, named, None, places["nostril, right"])


def led(
    task: Task,
    state: TaskState,
    known: GuidedHead,
    tip: Place,
    eye: Place | None = None,
) -> Goal:
    goal = goal_of(task, state, known, tip, eye)
    assert goal is not None
    return goal


AHEAD = np.array([0.0, 1.0, 0.0])
RINGS = (
    Ring("hoop 1", (0.0, 1.0, 0.0), 2.0),
    Ring("hoop 2", (0.0, 1.0, 0.0), 2.0),
)
HOOPS = Follow(name="hoops", title="", rings=RINGS)


def test_the_next_ring_is_the_goal_and_who_is_behind_it_goes_back() -> None:
    known = head()
    for passed, name in ((0.0, "hoop 1"), (0.5, "hoop 2")):
        state = TaskState("hoops", Status.OPEN, passed)
        middle = known.landmarks[name]
        before = led(HOOPS, state, known, middle - 5.0 * AHEAD)
        assert before.what == name
        assert 0.0 < (before.place_mm - middle)[1] < 3.0
        behind = led(HOOPS, state, known, middle + 2.0 * AHEAD)
        assert behind.what == f"back before {name}"
        assert (behind.place_mm - middle)[1] < -3.0


def test_what_is_left_on_the_own_side_is_the_goal_until_nothing_is() -> None:
    known = head()
    task = Remove(name="u", title="", tissues={"uncinate": Limits(10.0)})
    state = TaskState("u", Status.OPEN)
    tip = np.array([9.0, 2.0, 10.0])
    goal = led(task, state, known, tip)
    assert goal.what == "uncinate"
    assert goal.place_mm[0] < 10.0
    parts = {"uncinate process, right": Share(80.0)}
    part = led(Remove(name="p", title="", parts=parts), state, known, tip)
    assert part.what == "uncinate process, right"
    assert part.place_mm[0] < 10.0
    cut = known.distance.values.copy()
    cut[:, :, :20] = -1.0
    known = replace(known, distance=known.distance.with_values(cut, 9.0), parts={})
    assert goal_of(task, state, known, tip) is None


def test_tissue_that_the_lens_sees_goes_before_what_is_nearer() -> None:
    known = head()
    distance = known.distance.values.copy()
    # a wall beside the block hides all of it but one end
    distance[:, 27:30, :20] = 1.0
    distance[20:24, 38:40, 6:10] = 0.5
    labels = known.structures.labels.values.copy() if known.structures else distance
    labels[20:24, 38:40, 6:10] = Label.UNCINATE
    assert known.structures is not None
    air = known.distance.with_values(distance, 9.0)
    marks = known.structures.labels.with_values(labels, 0)
    names = {int(Label.UNCINATE): "uncinate"}
    named = Structures.of(air, marks, names, MappingProxyType(dict(known.landmarks)))
    known = replace(known, distance=air, structures=named, parts={})
    task = Remove(name="u", title="", tissues={"uncinate": Limits(10.0)})
    tip, eye = np.array([4.0, 12.5, 11.0]), np.array([4.0, 16.5, 11.0])
    state = TaskState("u", Status.OPEN)
    near, seen = (led(task, state, known, tip, at) for at in (tip, eye))
    assert near.place_mm[1] < 13.0
    assert seen.place_mm[1] > 18.0


def test_a_needle_is_led_to_where_it_counts() -> None:
    known = head()
    task = Inject(name="i", title="", place=(10.0, 5.0, 5.0), tool="injection needle")
    eye = np.array([3.0, 5.0, 5.0])
    goal = led(task, TaskState("i", Status.OPEN), known, eye)
    depth_mm = float(known.distance.sample(goal.place_mm))
    assert 0.0 < depth_mm < task.deepest_mm
    assert np.linalg.norm(goal.place_mm - np.array(task.place)) < task.radius_mm
    assert goal.place_mm[0] < 10.0


def test_an_opening_is_gone_to_where_it_is_narrowest() -> None:
    known = head()
    task = Open(
        name="o", title="", start=(4.0, 5.0, 5.0), end=(16.0, 5.0, 5.0), radius_mm=1.0
    )
    goal = led(task, TaskState("o", Status.OPEN), known, np.zeros(3))
    assert abs(goal.place_mm[0] - 10.0) <= 0.3


def test_the_first_open_task_with_an_end_is_to_be_done() -> None:
    keep = KeepAway(
        name="k", title="", hazards=("orbit",), margin_mm=1.0, most_dose_s=1.0
    )
    go = Reach(name="r", title="", place=(1.0, 2.0, 3.0), radius_mm=1.0)
    states = [TaskState("k", Status.OPEN), TaskState("r", Status.OPEN)]
    found = open_task([keep, go], states)
    assert found is not None
    assert found[0] is go
    goal = led(go, states[1], head(), np.zeros(3))
    assert goal.what == "r"
    done = [TaskState("k", Status.OPEN), TaskState("r", Status.DONE)]
    assert open_task([keep, go], done) is None
