import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scenarios.coverage import CoverageFigures, SiteSeen
from scenarios.metrics import (
    DEFINITIONS,
    Contacts,
    HazardGaps,
    Measured,
    PoseNoise,
    SessionNoise,
    Track,
    definitions_named,
    measure,
)
from scenarios.metrics.measured import ToolUse
from system import UserError
from tests.scenarios.metrics.tracks import (
    NO_TRACK,
    joined,
    of_scope,
    swaying,
    track,
    wander,
)

NOISE = SessionNoise(*[PoseNoise.even(0.05, 1e-4, 0.3, "test")] * 2)
TARGETS = {"ostium": np.array([3.0, 30.0, 2.0])}
NUMBERS = st.floats(-50, 50) | st.just(math.nan) | st.just(math.inf)


def whole(scope: Track, tool: Track = NO_TRACK) -> Measured:
    """A session with everything that is measured beside a track."""
    count = len(scope.time_s)
    gap = np.sin(np.arange(count))
    codes = np.where(gap < 0, 0, -1)
    contacts = Contacts(scope.time_s, gap, codes, ("septum",))
    hazards = HazardGaps(scope.time_s, {"orbit": 3 * gap, "duct": np.full(count, 9.0)})
    return of_scope(
        scope,
        tool,
        targets=TARGETS,
        contacts=contacts,
        hazards=hazards,
        tool_hazards=hazards,
        edits=(),
        breaches=(),
        tool_use=ToolUse(scope.time_s, {"curette": gap > 0.5}),
        coverage=CoverageFigures({"choana": SiteSeen(9.0, 50.0, 2.0)}, {}),
    )


def assert_sound(measured: Measured) -> None:
    """Every metric is a finite number or says why it is none."""
    for metric in measure(measured, NOISE):
        if metric.value is None:
            assert metric.reason, metric.name
            assert metric.sigma is None
        else:
            assert math.isfinite(metric.value), metric.name
        for figure in (metric.sigma, metric.floor):
            assert figure is None or math.isfinite(figure), metric.name
        for begin, end in metric.intervals:
            assert begin <= end, metric.name


def test_every_metric_has_a_value_in_a_session_that_has_everything() -> None:
    times, tips = wander(8.0)
    axes = swaying(times)
    scope, tool = track(times, tips, axes), track(times, tips[::-1] + 2, axes)
    missing = {m.name for m in measure(whole(scope, tool)) if m.value is None}
    # a task, a reference way and a centred target are not part of every session
    assert {name.partition(":")[0] for name in missing} <= {
        "economy of motion",
        "Hausdorff distance to expert",
        "Fréchet distance to expert",
        "time-warped distance to expert",
        "unsteadiness",
        "pixel motion",
        "wanted tissue removed",
        "removed tissue that was wanted",
        "protected tissue removed",
        "touched area",
        "cavity distance to expert",
        "Hausdorff cavity distance to expert",
        "cavity overlap with expert",
    }


@settings(max_examples=15, deadline=None)
@given(
    st.lists(st.floats(0, 3), max_size=12), st.lists(NUMBERS, min_size=36, max_size=36)
)
def test_few_or_broken_samples_give_reasons(
    times: list[float], numbers: list[float]
) -> None:
    tips = np.array(numbers[: 3 * len(times)]).reshape(-1, 3)
    assert_sound(whole(track(np.array(times), tips)))


@pytest.mark.parametrize("count", [0, 1, 2, 3, 4, 5])
def test_short_sessions_have_answers(count: int) -> None:
    times, tips = wander(1.0)
    assert_sound(whole(track(times[:count], tips[:count])))


def test_without_samples_all_is_too_little() -> None:
    found = {m.name: m for m in measure(of_scope(NO_TRACK), NOISE)}
    for name in ("task time", "path length", "SPARC", "pivot residual", "tool in view"):
        assert found[name].value is None
        assert found[name].reason.startswith("not enough data")


def test_a_clock_that_stands_still_gives_no_motion() -> None:
    _, tips = wander(1.0)
    measured = whole(track(np.full(len(tips), 7.0), tips))
    assert_sound(measured)
    assert all(m.value is None for m in measure(measured) if m.name == "mean speed")


def test_poses_that_are_lost_in_between_are_left_out() -> None:
    times, tips = wander(4.0)
    holed = tips.copy()
    holed[100:110] = np.nan
    (one,) = measure(
        of_scope(track(times, holed)), None, definitions_named(("depth",))
    )[:1]
    (other,) = measure(
        of_scope(track(times, tips)), None, definitions_named(("depth",))
    )[:1]
    assert one.value == pytest.approx(other.value, rel=0.01)


def test_chunks_give_the_same_bits() -> None:
    times, tips = wander(3.0)
    axes = swaying(times)
    parts = [slice(0, 1), slice(1, 140), slice(140, 141), slice(141, None)]
    chunks = [track(times[p], tips[p], axes[p]) for p in parts]
    assert measure(whole(joined(chunks)), NOISE) == measure(
        whole(track(times, tips, axes)), NOISE
    )


def test_an_unknown_name_is_told_with_the_known_ones() -> None:
    with pytest.raises(UserError, match=r"'speed'.*path length"):
        definitions_named(("speed",))
    assert {d.role for d in definitions_named(("SPARC",))} == {"scope", "tool"}


def test_a_metric_is_the_same_whatever_else_is_asked_for() -> None:
    """Also its noise: what nothing chosen reads is left out of the draws."""
    times, tips = wander(2.0)
    axes = swaying(times)
    whole_one = whole(track(times, tips, axes), track(times, tips[::-1] + 2, axes))
    together = measure(whole_one, NOISE)
    alone = [m for d in DEFINITIONS for m in measure(whole_one, NOISE, (d,))]
    assert alone == together
