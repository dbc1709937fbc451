"""Suite `skipping` measures both ways and compares their bits, on a small ball."""

from dataclasses import replace

import pytest

from benchmarks.losslessness import COMPARED, DIFFER
from benchmarks.plan import Task
from benchmarks.scenes import SubjectSource
from benchmarks.suites.skipping import EVERYWHERE, LEAPING, SkippingPlan
from renderers.art import Quality


def tasks(ball: SubjectSource, monkeypatch: pytest.MonkeyPatch) -> dict[str, Task]:
    monkeypatch.setattr("benchmarks.suites.skipping.subjects", lambda quick: (ball,))
    plan = SkippingPlan(quick=True)
    plan._size, plan._budget_s = 32, 0.0
    found = [t for t in plan.tasks() if t.case == "ball/outside/wall"]
    return {task.mode: task for task in found}


def test_leaping_takes_fewer_samples_and_the_same_bits(
    ball: SubjectSource, monkeypatch: pytest.MonkeyPatch
) -> None:
    both = tasks(ball, monkeypatch)
    assert both[LEAPING].baseline == EVERYWHERE
    assert "skips" in both[LEAPING].settings
    assert "skips" not in both[EVERYWHERE].settings
    plain, leaping = (both[m].measure().counters for m in (EVERYWHERE, LEAPING))
    assert leaping["samples"] < 0.7 * plain["samples"]
    assert leaping[COMPARED] == 32 * 32 * 4
    assert leaping[DIFFER] == 0


def test_a_lossy_way_would_be_told(
    ball: SubjectSource, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where the tracer skips what can be seen, values differ and are counted."""

    def lossy(quality: Quality, skip_empty: bool) -> Quality:
        cutoff = 0.4 if skip_empty else 0.0
        return replace(quality, cutoff=cutoff, skip_empty=skip_empty)

    monkeypatch.setattr("benchmarks.suites.skipping.replace", lossy)
    counters = tasks(ball, monkeypatch)[LEAPING].measure().counters
    assert counters[DIFFER] > 100
