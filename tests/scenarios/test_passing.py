"""A run is passed when every mark of its exercise is met."""

import pytest

from scenarios import Scenario
from scenarios.metrics import Metric
from scenarios.passing import pass_marks
from scenarios.scenario import MetricLimit, PassMarks
from scenarios.tasks.task import Reach

LOOK = Reach(name="a", title="", place="x", radius_mm=1.0)
MORE = Reach(name="b", title="", place="x", radius_mm=1.0, is_optional=True)
LIMIT = MetricLimit("contacts", "scope", most=3.0)
EXERCISE = Scenario(
    "e", "E", tasks=(LOOK, MORE), marks=PassMarks(metrics=(LIMIT,)), tools=("curette",)
)


def metrics(contacts: float | None, unlisted_s: float = 0.0) -> list[Metric]:
    return [
        Metric("contacts", "tool", "count", 99.0),
        Metric("contacts", "scope", "count", contacts, "not enough data: x"),
        Metric("unlisted tool in use", "tool", "s", unlisted_s),
    ]


@pytest.mark.parametrize(
    ("status", "contacts", "unlisted_s", "met"),
    [
        ("done", 3.0, 0.0, [True, True, True]),
        ("done", 3.1, 0.0, [True, False, True]),
        ("open", 0.0, 0.0, [False, True, True]),
        ("failed", 0.0, 2.0, [False, True, False]),
        ("done", None, 0.0, [True, None, True]),
    ],
)
def test_each_mark_is_judged_by_itself(
    status: str, contacts: float | None, unlisted_s: float, met: list[bool | None]
) -> None:
    found = pass_marks(EXERCISE, {"a": status}, metrics(contacts, unlisted_s))
    assert [mark.is_met for mark in found] == met


def test_what_nobody_measured_is_open() -> None:
    assert [m.is_met for m in pass_marks(EXERCISE, {}, [])] == [None] * 3


def test_named_tasks_stand_for_those_that_are_not_optional() -> None:
    named = Scenario("e", "E", tasks=(LOOK, MORE), marks=PassMarks(tasks=("b",)))
    (mark,) = pass_marks(named, {"a": "done", "b": "failed"}, [])
    assert (mark.title, mark.is_met, mark.why) == ("b", False, "failed")
