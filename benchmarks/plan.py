"""What is to be measured: tasks in suites, before anything runs."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field
from typing import ClassVar, Protocol

from benchmarks.schema import Clock, Setting, row_key
from benchmarks.timing import Timing
from renderers.scene import ImageError
from system import UserError


class ProgressReporter(Protocol):
    """Show how far a run is to whoever waits for it."""

    def __call__(self, stage: str, share: float) -> None:
        """Set a stage's done share, 0 to 1."""
        ...

    def say(self, text: str) -> None:
        """Tell one line."""
        ...


class UnavailableError(UserError):
    """Something the measurement needs is not on this machine; the text names it."""


@dataclass(frozen=True, slots=True)
class Measured:
    """Report one measurement; error and unit are None where there is no picture.

    further_rmse: other errors that are told with it; see `benchmarks.schema`.
    """

    timing: Timing
    error: ImageError | None = None
    error_unit: str | None = None
    counters: dict[str, float] = field(default_factory=dict)
    further_rmse: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Task:
    """Name one measurement and know how to make it.

    measure may raise `UnavailableError`. baseline: an earlier task's mode in the same
    case. cost_s: rough seconds on a slow core, so that a run with a time limit does
    not begin what it cannot end.
    """

    suite: str
    case: str
    mode: str
    measure: Callable[[], Measured]
    settings: dict[str, Setting]
    baseline: str | None = None
    clock: Clock = "cpu"
    cost_s: float = 6.0

    @property
    def key(self) -> tuple[str, str, str, str]:
        """Return the key its row will have."""
        return row_key(self.suite, self.case, self.mode, self.settings)


Suite = Callable[[bool], "Plan"]
"""Makes a plan; the argument is True for the quick sizes."""

SUITES: dict[str, Suite] = {}


class Plan(ABC):
    """Be a suite that is about to run.

    A class names its suite, as in ``class ArtPlan(Plan, suite="art")``: `paravol bench`
    then runs it. Nothing is computed before its tasks are measured. What a measurement
    leaves open is put on `stack`, which is closed after the last.
    """

    suite: ClassVar[str]

    def __init_subclass__(cls, *, suite: str = "") -> None:
        if suite in SUITES:
            raise UserError(f"two benchmark suites are called {suite!r}")
        if suite:
            cls.suite = suite
            SUITES[suite] = cls

    def __init__(self, quick: bool) -> None:
        """Choose the quick sizes or the whole ones."""
        self.quick = quick
        self.stack = ExitStack()

    @abstractmethod
    def tasks(self) -> list[Task]:
        """List the tasks, baselines before those that name them."""

    def close(self) -> None:
        """End child processes and threads, remove files."""
        self.stack.close()

    def task(
        self,
        case: str,
        mode: str,
        measure: Callable[[], Measured],
        settings: dict[str, Setting],
        baseline: str | None = None,
        clock: Clock = "cpu",
        cost_s: float = 6.0,
    ) -> Task:
        """Make a task of this suite."""
        return Task(self.suite, case, mode, measure, settings, baseline, clock, cost_s)

    def compared(
        self,
        case: str,
        runs: Mapping[str, Callable[[], Measured]],
        settings: dict[str, Setting],
        *,
        clock: Clock = "cpu",
        cost_s: float = 6.0,
        series: bool = False,
    ) -> list[Task]:
        """Make a task for each mode; the first is the baseline of the others.

        series: whether each is a series of its own in the report.
        """
        first = next(iter(runs))
        return [
            self.task(
                case,
                mode,
                run,
                settings | {"series": mode} if series else settings,
                None if mode == first else first,
                clock,
                cost_s,
            )
            for mode, run in runs.items()
        ]
