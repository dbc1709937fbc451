import threading
import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from queue import Queue
from typing import cast

import numpy as np
import pytest
from numpy.typing import NDArray

from paravol.guide.goals import GuidedHead
from paravol.guide.guide import Guide, GuideMark
from paravol.guide.scope_place import ScopePlaces, ScopePose
from renderers.scene import Camera, Volume
from scenarios import FrameState, tip_frame
from scenarios.tasks import Status, Task, TaskState
from scenarios.tasks.task import Inject, LookTask, Remove, Share
from tests.paravol.guide.test_air_way import walled

BEHIND, FREE = (18.0, 3.0, 3.0), (4.0, 16.0, 4.0)
TASKS = (
    LookTask(name="free", title="", place=FREE),
    LookTask(name="behind", title="", place=BEHIND, after=("free",)),
)


def view(forward: tuple[float, float, float]) -> FrameState:
    eye = np.array([4.0, 4.0, 4.0])
    way: NDArray[np.float64] = np.array(forward) / np.linalg.norm(forward)
    camera = Camera.looking_at(eye, eye + way, size=(64, 64))
    return FrameState(camera, tip_frame(eye, way), np.eye(4), 1.0, instrument="")


@pytest.fixture
def air() -> Volume:
    return walled()


def guiding(air: Volume, *tasks: Task, places: object = None) -> Guide:
    guide = Guide(tasks)
    head = GuidedHead(air, {}, None, None, np.zeros(3))
    guide.take_head(head, cast(ScopePlaces | None, places))
    return guide


@pytest.fixture
def guide(air: Volume) -> Iterator[Guide]:
    guide = guiding(air, *TASKS)
    yield guide
    guide.close()


def waited(guide: Guide, seen: FrameState, *states: TaskState) -> GuideMark:
    """Return the mark once there is a way, which is sought beside."""
    began = time.monotonic()
    while True:
        mark = guide.mark(seen, states, 0)
        found = guide._found
        if mark is not None and found is not None and found.has_sought:
            # one of a way that was just found
            again = guide.mark(seen, states, 0)
            assert again is not None
            return again
        assert time.monotonic() - began < 60.0
        time.sleep(0.01)


OPEN = TaskState("free", Status.OPEN, 0.25), TaskState("behind")
NEXT = TaskState("free", Status.DONE, 1.0), TaskState("behind", Status.OPEN)


def test_a_goal_in_sight_is_marked_where_it_is_seen(guide: Guide) -> None:
    seen = view((0.0, 1.0, 0.1))
    mark = waited(guide, seen, *OPEN)
    (column, row), _ = seen.camera.project(np.array(FREE))
    assert mark.is_goal
    assert mark.is_in_picture
    assert (mark.x, mark.y) == pytest.approx((column / 64, row / 64))
    assert mark.way_mm == pytest.approx(12.0)
    assert mark.progress == 0.25


def test_out_of_the_picture_it_lies_to_the_side_that_one_turns_to(guide: Guide) -> None:
    mark = waited(guide, view((0.0, -1.0, 0.1)), *OPEN)
    assert not mark.is_in_picture
    # seen along -y with z upwards, x lies to the left: the goal behind has no side
    level = waited(guide, view((1.0, 0.0, 0.0)), *OPEN)
    assert not level.is_in_picture
    assert level.x < 0.5  # +y is left of +x


def test_behind_a_wall_the_next_point_of_the_way_is_marked(guide: Guide) -> None:
    seen = view((0.3, 1.0, 1.0))
    mark = waited(guide, seen, *NEXT)
    assert not mark.is_goal
    assert mark.way_mm > 25.0
    # the way leads through the hole, which is ahead, not through the wall
    (column, row), _ = seen.camera.project(np.array([10.0, 16.0, 16.0]))
    assert np.hypot(mark.x - column / 64, mark.y - row / 64) < 0.2


def test_what_is_seen_from_too_far_away_is_gone_to(air: Volume) -> None:
    near = LookTask(name="free", title="", place=FREE, farthest_mm=5.0)
    guide = guiding(air, near)
    mark = waited(guide, view((0.0, 1.0, 0.1)), OPEN[0])
    guide.close()
    assert not mark.is_goal
    assert mark.is_in_picture
    assert mark.way_mm == pytest.approx(12.0, abs=1.0)


def test_nothing_is_marked_when_it_is_off_or_all_is_done(guide: Guide) -> None:
    seen = view((0.0, 1.0, 0.1))
    waited(guide, seen, *OPEN)
    guide.is_on = False
    assert guide.mark(seen, OPEN, 0) is None
    guide.is_on = True
    done = tuple(TaskState(t.name, Status.DONE) for t in TASKS)
    assert guide.mark(seen, done, 0) is None


def test_after_a_cut_the_way_is_found_anew(guide: Guide, air: Volume) -> None:
    seen = view((1.0, 0.0, 0.0))
    long = waited(guide, seen, *NEXT)
    air.values.flags.writeable = True
    air.values[:14, :14] = -3.0
    began = time.monotonic()
    while time.monotonic() - began < 60.0:
        mark = guide.mark(seen, NEXT, 1)
        if mark is not None and mark.is_goal and mark.way_mm < long.way_mm - 5.0:
            return
        time.sleep(0.05)
    raise AssertionError("the way stayed as it was")


class TwoPlaces:
    """Know two places for the needle and the backbiter, none for other tools."""

    def __init__(self) -> None:
        frames = [tip_frame(np.full(3, x), np.array([0.0, 1.0, 0.0])) for x in (1, 9)]
        self.poses = [ScopePose(frame, np.zeros(3), 0.0) for frame in frames]

    def for_tool(
        self,
        task: Task,
        state: TaskState,
        head: GuidedHead,
        view: FrameState,
        left_out: Sequence[NDArray[np.float64]] = (),
    ) -> ScopePose | None:
        if view.instrument not in ("injection needle", "backbiter"):
            return None
        return next(
            (
                p
                for p in self.poses
                if not any((p.frame[:3, 3] == t).all() for t in left_out)
            ),
            None,
        )

    def drawn_mm(self, now: NDArray[np.float64], pose: ScopePose) -> float:
        return 12.5


INJECT = Inject(name="do", title="", place=FREE, tool="injection needle")
Heard = tuple[ScopePose | None, float, str]


def asked(guide: Guide, tool: str, tools: Sequence[str] = ()) -> Heard | None:
    """Return what an assistant who is asked once says; None where he is not needed."""
    heard: Queue[Heard] = Queue()
    seen = replace(view((0.0, 1.0, 0.1)), instrument=tool)
    states = [TaskState("do", Status.OPEN)]
    if not guide.lay_scope(seen, states, 0, tools, lambda *all: heard.put(all)):
        return None
    return heard.get(timeout=60.0)


def test_an_assistant_lays_the_scope_elsewhere_each_time(air: Volume) -> None:
    places = TwoPlaces()
    guide = guiding(air, INJECT, places=places)
    told = [asked(guide, "injection needle") for _ in range(3)]
    guide.close()
    first, second = places.poses
    # from each of them once more
    assert told == [(first, 12.5, ""), (second, 12.5, ""), (first, 12.5, "")]


def test_an_assistant_names_a_tool_that_gets_there(air: Volume) -> None:
    part = {"uncinate process, right": Share(least_percent=80.0)}
    task = Remove(name="do", title="", parts=part)
    guide = guiding(air, task, places=TwoPlaces())
    all_tools = "ball probe", "curette", "straight forceps", "backbiter"
    assert asked(guide, "curette", all_tools) == (None, 0.0, "backbiter")
    assert asked(guide, "curette", all_tools[:3]) == (None, 0.0, "")
    assert asked(guide, "") is None
    guide.close()


def test_no_assistant_looks_for_who_is_to_look(air: Volume) -> None:
    task = LookTask(name="do", title="", place=FREE)
    guide = guiding(air, task, places=TwoPlaces())
    assert asked(guide, "injection needle") is None
    guide.close()


class SlowPlaces(TwoPlaces):
    """Find a place only once somebody lets them."""

    def __init__(self) -> None:
        super().__init__()
        self.looks, self.may = threading.Event(), threading.Event()

    def drawn_mm(self, now: NDArray[np.float64], pose: ScopePose) -> float:
        self.looks.set()
        assert self.may.wait(60.0)
        return 12.5


def test_nobody_hears_of_a_place_after_the_flight(air: Volume) -> None:
    """Who would hear of it is gone by then."""
    places = SlowPlaces()
    heard: list[object] = []
    before = threading.enumerate()
    guide = guiding(air, INJECT, places=places)
    (thread,) = (each for each in threading.enumerate() if each not in before)
    seen = replace(view((0.0, 1.0, 0.1)), instrument="injection needle")
    states = [TaskState("do", Status.OPEN)]
    guide.lay_scope(seen, states, 0, (), lambda *all: heard.append(all))
    assert places.looks.wait(60.0)
    guide.close()
    places.may.set()
    thread.join(60.0)
    assert not thread.is_alive()
    assert heard == []
