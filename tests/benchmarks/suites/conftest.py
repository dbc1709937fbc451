"""Suites on what is small: a ball, a coarse nose."""

from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack
from typing import Any, Protocol, TypeVar

import pytest

from benchmarks.plan import Measured, Plan, Task, UnavailableError
from benchmarks.scenes import SubjectSource
from renderers.scene import Scene

P = TypeVar("P", bound=Plan)


class Make(Protocol):
    """Makes a quick plan of a class; sets its attributes by their names."""

    def __call__(self, kind: type[P], **changes: Any) -> P: ...


def measured(tasks: Iterable[Task], peer: str = "") -> dict[tuple[str, str], Measured]:
    """Measure tasks; give them by case and mode. Only those of a peer may lack it."""
    found = {}
    for task in tasks:
        try:
            found[task.case, task.mode] = task.measure()
        except UnavailableError:
            assert peer
            assert peer in task.mode
    return found


def by_mode(tasks: Iterable[Task]) -> dict[str, Measured]:
    """Measure the tasks of one case."""
    return {mode: made for (_, mode), made in measured(tasks).items()}


def rmse(made: Measured) -> float:
    """Return the error of what has one."""
    assert made.error is not None
    return made.error.rmse


@pytest.fixture
def quick() -> Iterator[Make]:
    with ExitStack() as stack:

        def make(kind: type[P], **changes: Any) -> P:
            plan = kind(True)
            stack.callback(plan.close)
            for name, value in changes.items():
                setattr(plan, name, value)
            return plan

        yield make


@pytest.fixture
def on_ball(quick: Make, ball: SubjectSource, monkeypatch: pytest.MonkeyPatch) -> Make:
    def make(kind: type[P], **changes: Any) -> P:
        monkeypatch.setattr(f"{kind.__module__}.subjects", lambda quick: (ball,))
        return quick(kind, **changes)

    return make


@pytest.fixture
def in_nose(
    quick: Make,
    coarse_nasal_scene: Callable[[str], Scene],
    monkeypatch: pytest.MonkeyPatch,
) -> Make:
    def make(kind: type[P], **changes: Any) -> P:
        monkeypatch.setattr(f"{kind.__module__}.nasal_scene", coarse_nasal_scene)
        return quick(kind, **changes)

    return make
