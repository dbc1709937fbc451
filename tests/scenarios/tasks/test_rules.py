"""When tasks are done: closed forms, whatever the rate of the samples."""

import itertools
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import ArrayLike, NDArray

from anatomy.tissue import Label
from renderers.scene import Volume
from scenarios import Structures
from scenarios.endoscope import Endoscope, tip_frame
from scenarios.tasks import task as tasks
from scenarios.tasks.head_parts import Head
from scenarios.tasks.rules import ABSENT_S, is_in_sight, rule_of
from scenarios.tasks.situation import Situation
from surgery.kernels.carve import FULL
from surgery.patient import VolumeLedger

PLACES = {"ostium": np.array([0.0, 0.0, 0.0]), "bulla": np.array([5.0, 0.0, 0.0])}
AHEAD = np.array([0.0, 1.0, 0.0])
RATES = st.floats(8.0, 240.0)


def room(wall_y_mm: float | None = None) -> Volume:
    """Return air of 40 mm a side round the origin, with a wall of 1 mm across y."""
    count = 81
    y = np.linspace(-20.0, 20.0, count)
    gap = np.full(count, -5.0) if wall_y_mm is None else 0.5 - abs(y - wall_y_mm)
    values = np.broadcast_to(gap[None, :, None], (count,) * 3).astype(np.float32)
    return Volume(values, np.full(3, 0.5), np.full(3, -20.0))


OPEN_ROOM = room()


def two_sided_head() -> Head:
    """Return a head of polyps alone, the middle at x = 0."""
    solid = OPEN_ROOM.with_values(np.full((81,) * 3, 5.0, np.float32), -5.0)
    labels = solid.with_values(np.full((81,) * 3, Label.POLYP, np.uint8), 0.0)
    sides = {
        f"choana, {side}": np.array([x, 0.0, 0.0])
        for side, x in (("right", -6.0), ("left", 6.0))
    }
    names = {int(Label.POLYP): "polyp"}
    return Head(solid, Structures.of(solid, labels, names, sides))


def at(tip_mm: ArrayLike, time_s: float = 0.0, **more: Any) -> Situation:
    """Return a situation of a scope that looks along +y."""
    frame = tip_frame(np.array(tip_mm, float), AHEAD)
    camera = Endoscope().camera(frame, 0.0, (8, 8))
    return Situation(time_s, frame[:3, 3], camera, more.pop("distance", OPEN_ROOM))


def times(seconds: float, rate_hz: float) -> NDArray[np.float64]:
    return np.linspace(0.0, seconds, max(math.ceil(seconds * rate_hz), 1) + 1)


def run(task: tasks.Task, situations: list[Situation]) -> tuple[float, str]:
    rule, last_s = rule_of(task, PLACES), situations[0].time_s
    for now in situations:
        rule.step(now, now.time_s - last_s)
        last_s = now.time_s
    return rule.progress, rule.failed


@given(st.floats(-179.0, 179.0), st.floats(1.0, 170.0))
def test_a_picture_counts_as_level_up_to_its_turn(turn: float, level: float) -> None:
    task = tasks.LookTask(
        name="l", title="", place="ostium", hold_s=0.0, level_deg=level
    )
    frame = tip_frame(np.array([0.0, -10.0, 0.0]), AHEAD)
    camera = Endoscope().camera(frame, 0.0, (8, 8), turn)
    now = replace(at([0.0, -10.0, 0.0]), camera=camera)
    if abs(abs(turn) - level) > 1e-6:
        assert run(task, [now])[0] == float(abs(turn) < level)


@given(RATES, st.floats(0.2, 3.0), st.floats(0.1, 4.0))
def test_a_place_is_reached_when_the_tip_stayed_for_long_enough(
    rate_hz: float, hold_s: float, stayed_s: float
) -> None:
    task = tasks.Reach(
        name="a", title="a", place="ostium", radius_mm=2.0, hold_s=hold_s
    )
    progress, _ = run(task, [at((1.9, 0, 0), t) for t in times(stayed_s, rate_hz)])
    assert progress == pytest.approx(min(stayed_s / hold_s, 1.0), abs=1e-9)


def test_what_is_interrupted_begins_anew() -> None:
    task = tasks.Reach(name="a", title="a", place="ostium", radius_mm=2, hold_s=1)
    there = [at((1, 0, 0), t) for t in times(0.9, 50)]
    away = at((2.1, 0, 0), 0.91)
    back = [at((1, 0, 0), 0.92 + t) for t in times(0.9, 50)]
    assert run(task, [*there, away, *back])[0] == pytest.approx(0.9)
    # nobody knows where the tip was while no samples came
    absent = [at((1, 0, 0), 0.91 + ABSENT_S + t) for t in times(0.5, 50)]
    assert run(task, [*there, *absent])[0] == pytest.approx(0.5)


@pytest.mark.parametrize(
    ("eye", "deg", "seen"),
    [
        ((0, -10, 0), 5, True),
        ((2, -10, 0), 11, False),
        ((2, -10, 0), 12, True),
        ((0, -31, 0), 5, False),
        ((0, -1, 0), 5, False),
        ((0, 10, 0), 180, True),
        ((0, 10, 0), 90, False),
    ],
)
def test_a_place_is_looked_at_within_a_cone_and_a_range(
    eye: tuple[float, float, float], deg: float, seen: bool
) -> None:
    task = tasks.LookTask(name="a", title="a", place="ostium", within_deg=deg, hold_s=0)
    assert run(task, [at(eye)])[0] == seen


@given(st.floats(-9.0, 0.9))
def test_a_wall_hides_what_is_behind_it(wall_y_mm: float) -> None:
    eye, place = np.array([0.0, -12.0, 0.0]), np.zeros(3)
    hidden = not is_in_sight(room(wall_y_mm), eye, place)
    # a landmark may lie in the mucosa: what is no farther than that hides it
    assert hidden == (wall_y_mm - 0.5 <= -1.5)


@given(st.permutations(range(4)), st.booleans())
def test_rings_are_passed_in_their_order_and_forwards(
    order: list[int], is_backwards: bool
) -> None:
    rings = tuple(
        tasks.Ring((0.0, float(y), 0.0), (0.0, 1.0, 0.0), 1.0) for y in (1, 3, 5, 7)
    )
    task = tasks.Follow(name="a", title="a", rings=tuple(rings[n] for n in order))
    sign = -1 if is_backwards else 1
    ys = sign * np.arange(-20.0, 20.0, 0.3)
    progress, _ = run(task, [at((0.1, y, 0), 0.01 * n) for n, y in enumerate(ys)])
    # on one way along y those are passed that stand in rising order from the first on
    passed, place = 0, -1
    while passed < 4 and order[passed] > place:
        place = order[passed]
        passed += 1
    assert progress == (0 if is_backwards else passed / 4)


def test_one_step_may_pass_several_rings_and_none_beside_them() -> None:
    rings = tuple(tasks.Ring((0.0, y, 0.0), (0.0, 1.0, 0.0), 1.0) for y in (1.0, 3.0))
    task = tasks.Follow(name="a", title="a", rings=rings)
    assert run(task, [at((0, 0, 0)), at((0, 4, 0), 0.01)])[0] == 1.0
    assert run(task, [at((1.1, 0, 0)), at((1.1, 4, 0), 0.01)])[0] == 0.0


@given(RATES, st.floats(0.0, 6.0), st.floats(0.1, 5.0))
def test_the_dose_of_a_hazard_is_nearness_times_time(
    rate_hz: float, gap_mm: float, seconds: float
) -> None:
    dose_s = max(1 - gap_mm / 3.0, 0.0) * seconds
    task = tasks.KeepAway(
        name="a", title="a", hazards=("orbit",), margin_mm=3.0, most_dose_s=10.0
    )
    nows = [
        replace(at((0, 0, 0), t), hazards_mm={"orbit": gap_mm})
        for t in times(seconds, rate_hz)
    ]
    progress, failed = run(task, nows)
    assert progress == pytest.approx(1 - dose_s / 10.0, abs=1e-9)
    assert failed == ""
    strict = tasks.KeepAway(
        name="a",
        title="a",
        hazards=("orbit",),
        margin_mm=3.0,
        most_dose_s=dose_s * 0.99 - 1e-9,
    )
    assert (run(strict, nows)[1] != "") == (dose_s > 0.0 or strict.most_dose_s < 0)


def test_an_injury_fails_at_once() -> None:
    task = tasks.KeepAway(
        name="a", title="a", hazards=("orbit",), margin_mm=1, most_dose_s=9
    )
    hurt = replace(at((0, 0, 0)), injured=frozenset({"orbit"}))
    assert run(task, [hurt])[1] == "orbit was hurt"
    # whatever the dose, and however far away a tool was seen
    far = replace(hurt, hazards_mm={"orbit": 20.0})
    assert run(task, [far])[1] == "orbit was hurt"


def test_an_injection_needs_the_tool_its_pedal_and_the_right_depth() -> None:
    task = tasks.Inject(name="a", title="a", place=(0, 0, 0), tool="needle", hold_s=0)
    good = replace(
        at((0, -9, 0), distance=room(0.0)),
        tool="needle",
        is_working=True,
        tool_tip_mm=np.array([0.0, 0.2, 0.0]),
    )
    assert run(task, [good])[0] == 1.0
    for wrong in (
        {"tool": "freer"},
        {"is_working": False},
        {"tool_tip_mm": None},
        {"tool_tip_mm": np.array([0.0, -1.0, 0.0])},
        {"tool_tip_mm": np.array([2.1, 0.2, 0.0])},
    ):
        assert run(task, [replace(good, **wrong)])[0] == 0.0


def test_tissue_is_taken_within_limits() -> None:
    books = VolumeLedger(1.0)
    task = tasks.Remove(
        name="a",
        title="a",
        tissues={"mucosa": tasks.Limits(10.0, 20.0)},
        walls={"lamina papyracea": tasks.Limits(most_mm3=1.0)},
    )

    def taken(mm3: float, lamina: float = 0.0) -> tuple[float, str]:
        books.by_label[Label.MUCOSA] = round(mm3 * FULL)
        walls = {"lamina papyracea": lamina}
        now = replace(at((0, 0, 0)), books=books, wall_mm3=walls)
        return run(task, [now])

    assert taken(5.0)[0] == pytest.approx(0.5)
    assert taken(5.0)[1] == ""
    assert taken(12.0) == (1.0, "")
    assert taken(21.0)[1] == "21.0 mm3 of mucosa taken, 20 at most allowed"
    assert "lamina papyracea" in taken(12.0, 1.5)[1]


def test_too_much_of_a_part_fails_and_nothing_else_takes_of_it() -> None:
    """Of one side: the same tissue of the other is another part."""
    head = two_sided_head()
    task = tasks.Remove(
        name="a", title="a", parts={"polyp, right": tasks.Share(50.0, 80.0)}
    )
    rule = rule_of(task, PLACES, head)

    def taken(right: float, left: float) -> tuple[float, str, str]:
        fill = np.full(head.distance.shape, FULL, np.uint16)
        fill[..., 41:] = round((1.0 - left) * FULL)
        fill[..., :41] = round((1.0 - right) * FULL)
        now = replace(
            at((0, 0, 0)), books=VolumeLedger(1.0), fill=fill, edits=next(edits)
        )
        rule.step(now, 0.0)
        return rule.progress, rule.failed, rule.lacks

    edits = itertools.count()
    assert taken(0.0, 1.0)[0] == 0.0
    progress, failed, lacks = taken(0.25, 0.9)
    assert progress == pytest.approx(0.5, abs=1e-3)
    assert (failed, lacks) == ("", "polyp, right: 75 % left")
    assert taken(0.5, 0.0)[0] == pytest.approx(1.0, abs=1e-3)
    assert "81 % of polyp, right taken" in taken(0.81, 0.0)[1]


def test_what_only_spares_is_done_at_the_end() -> None:
    task = tasks.Remove(
        name="a", title="a", tissues={"middle turbinate": tasks.Limits(most_mm3=5.0)}
    )
    assert rule_of(task, PLACES).is_kept
    asking = tasks.Remove(name="a", title="a", parts={"polyp, left": tasks.Share(1.0)})
    assert not rule_of(asking, PLACES).is_kept


def test_a_way_is_open_when_a_ball_fits_through() -> None:
    task = tasks.Open(
        name="a", title="a", start=(0, -5, 0), end=(0, 5, 0), radius_mm=2.5
    )
    assert run(task, [at((0, 0, 0), distance=room(0.0))])[0] == 0.0
    assert run(task, [at((0, 0, 0))])[0] == 1.0
    wider = tasks.Open(
        name="a", title="a", start=(0, -5, 0), end=(0, 5, 0), radius_mm=10
    )
    x = np.abs(np.linspace(-20.0, 20.0, 81)) - 5.0
    slit = np.broadcast_to(x, (81,) * 3).astype(np.float32)
    gap = OPEN_ROOM.with_values(slit, -5.0)
    assert run(wider, [at((0, 0, 0), distance=gap)])[0] == pytest.approx(0.5, abs=0.02)


def test_sites_are_seen_by_percent() -> None:
    task = tasks.Survey(name="a", title="a", sites={"choana": 80, "bulla": 40})
    now = replace(at((0, 0, 0)), seen_percent={"choana": 40, "bulla": 90})
    assert run(task, [now])[0] == pytest.approx(0.75)
    assert run(task, [replace(now, seen_percent={"choana": 80, "bulla": 90})])[0] == 1


def test_a_hold_begins_anew_where_the_tip_moved_too_far() -> None:
    task = tasks.Hold(
        name="a", title="a", place="ostium", radius_mm=5, still_mm=0.5, hold_s=1
    )
    still = [at((0.3 * (n % 2), 0, 0), t) for n, t in enumerate(times(1.0, 20))]
    assert run(task, still)[0] == 1.0
    drifting = [at((2.0 * t, 0, 0), t) for t in times(1.9, 20)]
    assert run(task, drifting)[0] < 0.5
