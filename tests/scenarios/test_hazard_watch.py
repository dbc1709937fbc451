"""Nearest approaches to what must not be hurt."""

from dataclasses import asdict
from typing import Any

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from anatomy.hazard_volumes import FARTHEST_MM, UNIT_MM, HazardVolumes
from renderers.scene import Volume
from scenarios import Endoscope, Sample, Score, Session, tip_frame
from scenarios.hazard_watch import HazardGaps, HazardWatch, hazard_gaps
from scenarios.instrument_state import EMPTY_HAND

BALLS = {"orbit": ((9.0, 10.0, 10.0), 3.0), "septum": ((10.0, 20.0, 10.0), 2.0)}


def balls() -> HazardVolumes:
    """Measure balls in a box of 24 mm at 0.5 mm."""
    grid = np.indices((49, 49, 49))[::-1].reshape(3, -1).T * 0.5
    volumes = {}
    for name, (center, radius) in BALLS.items():
        distance = np.linalg.norm(grid - center, axis=1) - radius
        steps = np.rint(np.minimum(distance, FARTHEST_MM) / UNIT_MM).astype(np.int16)
        volumes[name] = Volume(
            steps.reshape(49, 49, 49),
            np.full(3, 0.5),
            np.zeros(3),
            background=FARTHEST_MM / UNIT_MM,
        )
    return HazardVolumes(volumes, "test")


places = st.tuples(*(st.floats(2.0, 22.0) for _ in range(3)))
ways = st.tuples(*(st.floats(-1.0, 1.0) for _ in range(3))).filter(
    lambda way: np.linalg.norm(way) > 0.1
)


@given(places, ways, places)
def test_gaps_are_those_of_a_capsule_and_a_point(
    tip: tuple[float, float, float],
    forward: tuple[float, float, float],
    tool: tuple[float, float, float],
) -> None:
    way = np.array(forward) / np.linalg.norm(forward)
    frame = tip_frame(np.array(tip), way)
    gaps = hazard_gaps(balls(), frame, 1.35, 6.0, np.array(tool))
    assert gaps.instrument is not None
    for name, (center, radius) in BALLS.items():
        middle = np.array(center)
        tip_mm = np.linalg.norm(middle - tip) - radius
        assert gaps.tip[name] == pytest.approx(tip_mm, abs=0.06)
        tool_mm = np.linalg.norm(middle - np.array(tool)) - radius
        assert gaps.instrument[name] == pytest.approx(tool_mm, abs=0.06)
        along = np.clip((middle - tip) @ -way, 1.35, 6.0)
        place = np.array(tip) - along * way
        if np.all((place > 0.0) & (place < 24.0)):
            shaft_mm = np.linalg.norm(middle - place) - radius - 1.35
            assert gaps.shaft[name] == pytest.approx(shaft_mm, abs=0.2)


gap_lists = st.lists(
    st.tuples(st.floats(-3, 9), st.floats(-3, 9), st.none() | st.floats(-3, 9)),
    min_size=1,
    max_size=30,
)


@given(gap_lists)
def test_the_watch_keeps_each_least_gap_and_its_first_time(
    found: list[tuple[float, float, float | None]],
) -> None:
    watch = HazardWatch()
    for i, (tip, shaft, tool) in enumerate(found):
        held = None if tool is None else {"orbit": tool}
        watch.add(0.5 * i, HazardGaps({"orbit": tip}, {"orbit": shaft}, held))
    at = watch.approaches()["orbit"]
    tips, shafts, tools = zip(*found, strict=True)
    assert (at.tip_mm, at.tip_s) == (min(tips), 0.5 * tips.index(min(tips)))
    assert (at.shaft_mm, at.shaft_s) == (min(shafts), 0.5 * shafts.index(min(shafts)))
    used = [tool for tool in tools if tool is not None]
    if used:
        assert at.instrument_mm == min(used)
        assert at.instrument_s == 0.5 * tools.index(min(used))
    else:
        assert (at.instrument_mm, at.instrument_s) == (None, None)
    everything = [*tips, *shafts, *used]
    assert at.nearest_mm == min(everything)


def test_the_septum_is_never_the_nearest_hazard() -> None:
    gaps = HazardGaps({}, {"orbit": 5.0, "septum": 0.2}, {"orbit": 3.0, "septum": 0.1})
    assert gaps.nearest() == ("orbit", 3.0)
    assert HazardGaps({}, {"septum": 0.2}, None).nearest() is None


def session(hazards: HazardVolumes | None) -> Session:
    air = Volume(np.full((49, 49, 49), -9.0, np.float32), np.full(3, 0.5), np.zeros(3))
    return Session(
        Endoscope(diameter_mm=2.7), np.eye(4), air, {}, (8, 8), hazards=hazards
    )


def sample(time_s: float, x: float, **state: Any) -> Sample:
    forward = np.array([0.0, 0.0, -1.0])
    frame = tip_frame(np.array([x, 10.0, 10.0]), forward)
    tool = np.array([20.0, 10.0, 10.0])
    return Sample(time_s, frame, 0.0, tool, forward, 0, **state)


def test_a_session_scores_scope_and_tool() -> None:
    flown = session(balls())
    for i in range(5):
        flown.step(sample(0.1 * i, 20.0 - i))
    found = flown.score().hazards
    assert found is not None
    at = found["orbit"]
    assert at.tip_mm == pytest.approx(4.0, abs=0.03)
    assert at.tip_s == pytest.approx(0.4)
    assert at.shaft_mm == pytest.approx(4.0 - 1.35 + 0.13, abs=0.15)
    assert at.instrument_mm == pytest.approx(8.0, abs=0.03)
    nearest = flown.view(sample(0.5, 14.0)).hazard
    assert nearest is not None
    assert nearest[0] == "orbit"
    assert nearest[1] == pytest.approx(0.75, abs=0.2)
    decoded = msgspec.convert(asdict(flown.score()), Score)
    assert decoded == flown.score()


def test_an_empty_hand_has_no_tool_and_an_unlabelled_head_no_hazards() -> None:
    flown = session(balls())
    flown.step(sample(0.0, 18.0, instrument=EMPTY_HAND))
    found = flown.score().hazards
    assert found is not None
    assert found["orbit"].instrument_mm is None
    bare = session(None)
    bare.step(sample(0.0, 18.0))
    assert bare.score().hazards == {}
    assert bare.view(sample(0.0, 18.0)).hazard is None
