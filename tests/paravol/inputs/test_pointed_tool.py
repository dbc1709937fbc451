"""A tool goes where somebody points: from outside, beside the scope, into no tissue."""

import math
from collections.abc import Callable
from concurrent.futures import Executor, Future
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from anatomy.hazard_volumes import UNIT_MM, HazardVolumes
from devices import Pose
from devices.controls.fulcrum import Demand
from paravol.feedback.shaft_heading import place_in_picture
from paravol.inputs.hand import pointed_tool, scope_control
from paravol.inputs.instrument_controller import FIRST_AHEAD_MM, InstrumentController
from paravol.inputs.pointed_tool import MOVING_S, NEAREST_MM
from paravol.inputs.tool_hold import (
    BESIDE_MM,
    BITES_MM,
    TOUCH_MM,
    YIELDS_MM,
    ToolHold,
    tool_balls,
)
from paravol.inputs.tool_plan import (
    ASIDE_MM,
    ENTRY_MM,
    JAWS_MM,
    SHUT_STEPS,
)
from paravol.inputs.tool_plan import (
    Pose as Lie,
)
from paravol.patient import load_patient, no_progress
from paravol.sessions.session_setup import build_session, operate_on
from renderers.scene import Volume
from scenarios import Sample, load_scenario
from scenarios.clearance import tool_clearance
from scenarios.instruments import INSTRUMENTS
from scenarios.instruments.contact_shape import contact_table, placed_table
from scenarios.sample import tool_frame
from surgery.contact import between
from tests.paravol.inputs.pointing import (
    FULCRUM,
    SCOPE,
    SPACING_MM,
    hand_before,
    joined,
    reached,
    settled,
    shaft_of_tool,
    tip,
    wall_at,
)

places = st.tuples(st.floats(-0.9, 0.9), st.floats(-0.9, 0.9))
tools = st.sampled_from(sorted(INSTRUMENTS))
LOOSE_MM = 0.15
"""Balls along a tool are thinner between them, and far turns are gone in steps."""


@given(tools, places)
@settings(max_examples=12)
def test_it_begins_outside_and_passes_the_nostril(
    name: str, at: tuple[float, float]
) -> None:
    hand = hand_before(-40.0, name)
    hand.point(*at)
    pivot, axis = FULCRUM.pivot_mm, FULCRUM.axis
    assert hand.pointed is not None
    assert (tip(hand, 0.0) - pivot) @ axis < 0.0
    for number in range(1, 300):
        sample = joined(hand, Pose(0.01 * number, 0.01 * number, np.eye(4), 0))
        shaft = shaft_of_tool(name, tool_frame(sample))
        way = pivot - shaft[:3, 3]
        off = way - (way @ shaft[:3, 2]) * shaft[:3, 2]
        assert np.linalg.norm(off) < ENTRY_MM + 2.0


@given(places)
@settings(max_examples=12)
def test_it_comes_to_where_somebody_points(at: tuple[float, float]) -> None:
    """But for what the scope leaves it: that is no farther than is looked for."""
    hand = hand_before(-40.0, "suction tube")
    hand.point(*at)
    place = tip(hand, settled(hand) + 0.01)
    camera = SCOPE.camera(np.eye(4), 0.0, (8, 8))
    away = np.linalg.norm(place)
    assert away == pytest.approx(FIRST_AHEAD_MM, abs=ASIDE_MM + 1.0)
    seen = place_in_picture(camera, place)
    assert seen is not None
    off = np.array([2.0 * seen[0] - 1.0, 1.0 - 2.0 * seen[1]]) - at
    angle = np.linalg.norm(off) * camera.extent
    assert angle * away < ASIDE_MM + 1.5


@given(
    tools,
    st.lists(st.tuples(places, st.floats(-15.0, 15.0), st.booleans()), max_size=5),
)
@settings(max_examples=10, deadline=None)
def test_nothing_is_pushed_deeper_than_mucosa_yields(
    name: str, script: list[tuple[tuple[float, float], float, bool]]
) -> None:
    """Nor into the scope, however it is pointed; a tool that works bites as deep."""
    distance = wall_at(-18.0)
    hand, other = hand_before(-18.0, name), hand_before(-18.0, name)
    time_s = 0.0
    for at, by_mm, works in script:
        for each in (hand, other):
            each.point(*at)
            each.advance(by_mm)
            each.work(works)
        for _ in range(60):
            time_s += 0.01
            pose = Pose(time_s, time_s, np.eye(4), 0)
            sample, again = joined(hand, pose), joined(other, pose)
            assert sample.instrument_tip_mm.tobytes() == (
                again.instrument_tip_mm.tobytes()
            )
            state = sample.instrument
            table = contact_table(name, state.jaw)
            if INSTRUMENTS[name].has_jaws:
                # what bites goes about what it bites, and back from there
                assert hand.pointed is not None
                is_about = works or hand.pointed._stroke > 0.0
                table = table[table[:, 2] >= (JAWS_MM if is_about else 0.0)]
            table = placed_table(table, tool_frame(sample))
            deep = -tool_clearance(distance, table).gap_mm
            assert deep <= TOUCH_MM + max(YIELDS_MM, BITES_MM) + LOOSE_MM
            assert beside_mm(sample, name) > -0.5
        # one that has worked has eased off
        assert works or deep <= TOUCH_MM + YIELDS_MM + LOOSE_MM


def beside_mm(sample: Sample, name: str) -> float:
    """Return the room between the straight shaft and the end of the scope, mm."""
    frame = shaft_of_tool(name, tool_frame(sample))
    balls = tool_balls(name, SHUT_STEPS)
    balls = balls[balls[:, 0] >= 12.0]
    places = frame[:3, 3] + balls[:, :1] * frame[:3, 2] + balls[:, 2:] @ frame[:3, :3].T
    along = np.clip(places[:, 2], 0.0, BESIDE_MM)
    off = np.linalg.norm(places - along[:, None] * np.array([0.0, 0.0, 1.0]), axis=1)
    return float((off - balls[:, 1]).min()) - SCOPE.diameter_mm / 2


@pytest.mark.parametrize("name", ["straight forceps", "curette"])
def test_it_stops_at_tissue_where_an_edge_goes_deeper(name: str) -> None:
    """Jaws go in about what they bite, and no farther than they are long."""
    hand = hand_before(-10.0, name)
    hand.point(0.0, -0.5)
    end_s = settled(hand)
    idle = tip(hand, end_s + 0.01)
    hand.work(True)
    end_s = settled(hand, end_s + 0.01, 1.0)
    worked = tip(hand, end_s + 0.01)
    assert -10.0 - TOUCH_MM - YIELDS_MM - 0.1 < idle[2] < -8.0
    if INSTRUMENTS[name].has_jaws:
        assert 0.0 < idle[2] - worked[2] < JAWS_MM
    else:
        assert 0.5 < idle[2] - worked[2] < BITES_MM + 0.5


@pytest.mark.parametrize("name", ["ball probe", "suction tube", "curved suction"])
@pytest.mark.parametrize("at_mm", [-10.0, -10.3, -10.6, -14.45])
def test_a_blunt_tool_touches_what_is_pointed_at(name: str, at_mm: float) -> None:
    hand = hand_before(at_mm, name)
    hand.point(0.0, -0.5)
    hand.advance(30.0)
    end_s = settled(hand)
    sample = joined(hand, Pose(end_s + 0.01, end_s + 0.01, np.eye(4), 0))
    table = placed_table(contact_table(name, 1.0), tool_frame(sample))
    gap_mm = tool_clearance(wall_at(at_mm), table).gap_mm
    assert -TOUCH_MM - YIELDS_MM - LOOSE_MM < gap_mm <= 0.0


def test_what_tissue_held_back_does_not_gather() -> None:
    hand = hand_before(-8.0)
    hand.point(0.0, -0.4)
    end_s = settled(hand)
    for _ in range(20):
        hand.advance(1.0)
    end_s = settled(hand, end_s)
    before = tip(hand, end_s + 0.01)
    hand.advance(-3.0)
    end_s = settled(hand, end_s + 0.01)
    assert tip(hand, end_s + 0.01)[2] > before[2] + 1.5
    hand.advance(-100.0)
    end_s = settled(hand, end_s)
    assert np.linalg.norm(tip(hand, end_s + 0.01)) < NEAREST_MM + ASIDE_MM
    hand.advance(1000.0)
    end_s = settled(hand, end_s + 0.01)
    assert -8.0 - TOUCH_MM - YIELDS_MM - LOOSE_MM < tip(hand, end_s + 0.01)[2] < -6.0


def test_it_stays_while_nobody_points() -> None:
    hand = hand_before(-40.0)
    end_s = settled(hand)
    hand.let_point(False)
    before = tip(hand, end_s + 0.01)
    hand.point(0.5, 0.5)
    assert np.array_equal(tip(hand, settled(hand, end_s + 0.01)), before)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_no_carrying_hurts_anybody(seed: int) -> None:
    """A minute of any pointing in a real nose, the scope on its way, every tool."""
    folder = Path("scenarios/curriculum")
    scenario, _ = load_scenario(str(folder / "uncinectomy.toml"))
    head = load_patient(scenario, no_progress)
    patient, operation = operate_on(head)
    session = build_session(scenario, patient, np.eye(4), (64, 64), operation)
    scope = scenario.scope.endoscope()
    control = scope_control(patient, None, scope.diameter_mm / 2, scenario.start)
    hand = InstrumentController(scope)
    rest = operation.patient.surface.distance
    hand.pointed = pointed_tool(patient, rest, None, scenario)
    hand.felt_n = lambda: operation.touch.size_n
    rng = np.random.default_rng(seed)
    sites = "middle meatus", "uncinate process", "choana", "sphenoethmoidal recess"
    goals = [patient.landmarks[f"{site}, right"] for site in sites]
    for number in range(6000):
        time_s = 0.01 * number
        if number % 300 == 0:
            hand.choose(str(rng.choice(sorted(INSTRUMENTS))))
            aim = goals[rng.integers(len(goals))] + rng.normal(size=3) * 3.0
        if number % 90 == 0:
            hand.point(*rng.uniform(-0.8, 0.8, 2))
            hand.advance(float(rng.uniform(-10.0, 10.0)))
        way = aim - control.frame()[:3, 3]
        right, up = control.frame()[:3, 0], control.frame()[:3, 1]
        turns = np.clip([way @ right / 20.0, way @ up / 20.0], -1.0, 1.0)
        inwards = float(np.clip((way @ control.pointing - 15.0) / 5.0, -1.0, 1.0))
        control.advance(0.01, Demand(inwards, float(turns[0]), float(turns[1])))
        pose = Pose(time_s, time_s, control.frame(), 0)
        session.step(joined(hand, pose))
        assert operation.take_injuries() == []
        operation.take_changes()
    assert operation.feeling.figures.breaks == ()


@pytest.mark.parametrize("step_s", [0.01, 0.1])
@pytest.mark.parametrize("side", [-0.5, 0.0, 0.5])
def test_a_caught_tool_goes_out_beside_what_must_not_be_hurt(
    step_s: float, side: float
) -> None:
    """Tissue closes between its hook and the nostril, and a duct lies in it."""
    hand, pointed, time_s = reached("backbiter")
    distance = wall_at(-14.0)
    k, j, i = np.indices(distance.shape) * SPACING_MM
    places = np.stack([i, j, k], axis=-1) + distance.origin_mm
    balls = tool_balls("backbiter", 14)
    frame = pointed.frame
    along = frame[:3, 3] + balls[:, :1] * frame[:3, 2]
    there = along + balls[:, 2:] @ frame[:3, :3].T
    hook = there[np.argmax(np.linalg.norm(balls[:, 2:], axis=1))]
    # room for the shaft alone
    off = places - frame[:3, 3]
    off -= (off @ frame[:3, 2])[..., None] * frame[:3, 2]
    beside = np.linalg.norm(off, axis=-1) - 2.6
    slab = np.minimum(3.0 - np.abs(places[..., 2] + 4.0), beside)
    walls = np.maximum(np.asarray(distance.values), slab).astype(np.float32)
    on_its_way = hook + (-4.0 - hook[2]) * np.array([0.0, 0.0, 1.0])
    on_its_way = on_its_way + side * frame[:3, 0]
    gaps = np.linalg.norm(places - on_its_way, axis=-1) - 0.5
    steps = np.rint(np.minimum(gaps, 20.0) / UNIT_MM).astype(np.int16)
    duct = Volume(steps, distance.spacing_mm, distance.origin_mm, background=2500.0)
    caught = distance.with_values(walls, -100.0)
    hazards = HazardVolumes({"duct": duct})
    pointed.hold = ToolHold(caught, FULCRUM.pivot_mm, hazards)
    # as after a turn: no way in is known by which it could leave
    pointed._trail.clear()
    hand.is_scope_laid = lambda: True
    nearest, into = np.inf, pointed.frame[:3, 2]
    for _ in range(round(3.0 / step_s)):
        before = pointed.frame
        time_s += step_s
        joined(hand, Pose(time_s, time_s, np.eye(4), 0))
        for share in np.linspace(0.0, 1.0, 9):
            frame = between(before, pointed.frame, float(share))
            along = frame[:3, 3] + balls[:, :1] * frame[:3, 2]
            there = along + balls[:, 2:] @ frame[:3, :3].T
            off = np.linalg.norm(there - on_its_way, axis=1) - 0.5 - balls[:, 1]
            nearest = min(nearest, float(off.min()))
        # it leans, and does not tumble
        assert pointed.frame[:3, 2] @ into > 0.97
    assert pointed.depth_mm < 0.0
    assert nearest > 0.0


@pytest.mark.parametrize(
    ("left_mm", "hazard_mm", "is_told"),
    [(3.0, 20.0, True), (3.0, 1.0, False), (5.5, 20.0, False), (1.0, 1.0, True)],
)
def test_a_tool_that_is_held_off_bites_where_a_push_hurts_nothing(
    left_mm: float, hazard_mm: float, is_told: bool
) -> None:
    """hazard_mm: from where the bite closes; one that lies there was looked at."""
    hand, pointed, time_s = reached()
    assert pointed.bite is not None
    end, _ = pointed.bite
    distance = wall_at(-14.0)
    k, j, i = np.indices(distance.shape)
    places = np.stack([i, j, k], axis=-1) * SPACING_MM
    gaps = np.linalg.norm(places + distance.origin_mm - end[:3, 3], axis=-1)
    steps = np.rint(np.minimum(gaps + hazard_mm - 3.0, 20.0) / UNIT_MM)
    near = distance.with_values(steps.astype(np.int16), 2500.0)
    held = ToolHold(distance, FULCRUM.pivot_mm, HazardVolumes({"artery": near}))
    # walls hold it there
    held.push = lambda *words, **more: None  # type: ignore[method-assign]
    held.__class__ = type("Held", (ToolHold,), {"__call__": lambda s, a, b: a})
    pointed.hold = held
    pointed.frame = pointed.frame.copy()
    pointed.frame[:3, 3] += left_mm * pointed.frame[:3, 2]
    joined(hand, Pose(time_s + 0.01, time_s + 0.01, np.eye(4), 0))
    assert (pointed.bite is not None) == is_told


def test_a_tool_that_is_held_all_along_does_not_tumble() -> None:
    """What must not be hurt lies beside it on its whole way out."""
    hand, pointed, time_s = reached("backbiter")
    begun = pointed.frame
    distance = wall_at(-14.0)
    k, j, i = np.indices(distance.shape) * SPACING_MM
    off = np.stack([i, j, k], axis=-1) + distance.origin_mm - begun[:3, 3]
    aside = off @ begun[:3, 0]
    # a slit that is narrower than the tool, and a nerve along one side of it
    slit = np.maximum(np.asarray(distance.values), np.abs(aside) - 0.5)
    caught = distance.with_values(slit.astype(np.float32), -100.0)
    steps = np.rint(np.clip(1.8 + aside, -5.0, 20.0) / UNIT_MM).astype(np.int16)
    nerve = Volume(steps, distance.spacing_mm, distance.origin_mm, background=2500.0)
    hazards = HazardVolumes({"nerve": nerve})
    pointed.hold = ToolHold(caught, FULCRUM.pivot_mm, hazards)
    pointed._trail.clear()
    hand.is_scope_laid = lambda: True
    for _ in range(200):
        time_s += 0.01
        joined(hand, Pose(time_s, time_s, np.eye(4), 0))
        assert pointed.frame[:3, 2] @ begun[:3, 2] > math.cos(math.radians(8.0))
        if pointed.depth_mm < 0.0:
            break
    assert pointed.depth_mm < 0.0


class Later(Executor):
    """Does work when it is asked to."""

    def __init__(self) -> None:
        self.works: list[tuple[Future[Any], partial[Any]]] = []

    def submit(
        self, work: Callable[..., Any], /, *words: Any, **named: Any
    ) -> Future[Any]:
        future: Future[Any] = Future()
        self.works.append((future, partial(work, *words, **named)))
        return future

    def do(self) -> None:
        while self.works:
            future, work = self.works.pop()
            future.set_result(work())

    def tools(self) -> list[str]:
        """Return which tools' poses are asked for."""
        return [work.keywords["name"] for _, work in self.works]


def test_poses_are_compared_beside_the_samples() -> None:
    """The tool waits for that, and goes then to where it goes without."""
    ends = []
    for later in (None, Later()):
        hand = hand_before(-14.0)
        assert hand.pointed is not None
        hand.pointed.beside = later
        hand.point(0.0, -0.4)
        hand.advance(20.0)
        time_s = settled(hand, for_s=0.5)
        if later is not None:
            assert not hand.pointed.has_come
            assert len(later.works) == 1
            later.do()
        settled(hand, time_s)
        ends.append(hand.pointed.frame)
        assert hand.pointed.has_come
    np.testing.assert_allclose(ends[1], ends[0], atol=0.02)


def test_who_compares_for_long_makes_no_tool_a_stuck_one(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def through(place: NDArray[np.float64], **_: Any) -> Lie:
        """Lead it on, through the wall."""
        return Lie(FULCRUM.pivot_mm, place + 30.0 * FULCRUM.axis, 0.0, 0.0)

    later, hand = Later(), hand_before(-14.0)
    pointed = hand.pointed
    assert pointed is not None
    pointed.beside = later
    monkeypatch.setattr(pointed.plan, "choose", through)
    hand.point(0.0, -0.4)
    hand.advance(20.0)
    time_s = settled(hand, for_s=0.1)
    later.do()
    time_s = settled(hand, time_s, 6.0)
    assert len(later.works) == 1
    assert not hand.is_stuck
    assert len(later.works[0][1].keywords["vain"]) == 1


def test_a_pose_for_another_tool_is_not_taken() -> None:
    later, hand = Later(), hand_before(-14.0)
    assert hand.pointed is not None
    hand.pointed.beside = later
    hand.point(0.0, -0.4)
    hand.advance(20.0)
    time_s = settled(hand, for_s=0.5)
    hand.choose("microdebrider")
    time_s = settled(hand, time_s, 0.2)
    assert later.tools() == ["straight forceps", "microdebrider"]
    future, work = later.works[0]
    future.set_result(work())
    settled(hand, time_s, 0.5)
    assert not hand.pointed.has_come


def test_who_points_on_is_answered_less_often_than_who_rests() -> None:
    counts = []
    for speed in (0.0, 0.3):
        later, hand, asked = Later(), hand_before(-14.0), 0
        assert hand.pointed is not None
        hand.pointed.beside = later
        hand.advance(20.0)
        for n in range(200):
            hand.point(0.4 * math.cos(speed * n / 10), 0.4 * math.sin(speed * n / 10))
            tip(hand, n / 100)
            asked += len(later.works)
            later.do()
        counts.append(asked)
    assert counts[0] <= 2
    assert 4 <= counts[1] <= 2.0 / MOVING_S + 2
