"""Run suites, keep what is finished, compare with baselines measured alongside."""

import time
from collections.abc import Callable, Iterable
from contextlib import closing
from functools import partial
from pathlib import Path

import benchmarks.suites  # noqa: F401 (importing them fills `SUITES`)
from benchmarks.machine import commit, is_same_machine, machine
from benchmarks.plan import (
    SUITES,
    Measured,
    ProgressReporter,
    Suite,
    Task,
    UnavailableError,
)
from benchmarks.ranks.scaling_report import report_scaling
from benchmarks.reporting import write_report
from benchmarks.schema import (
    Results,
    Row,
    Skipped,
    Times,
    load_results,
    ratio_of,
    save_results,
)
from paravol.versions import versions
from system import UserError

QUICK_LIMIT_S = 165.0
"""A quick run begins nothing that would probably end later than this. Of n suites the
k-th may use k/n of it, so that each gets something; what one leaves the next has."""

RESULTS_FILE = "results.json"
REPORT_FILE = "report.html"


def run_bench(
    *,
    suites: tuple[str, ...],
    quick: bool,
    out: Path,
    fresh: bool,
    progress: ProgressReporter,
    only: str = "",
) -> tuple[Results, list[Path]]:
    """Measure, going on from what an interrupted run left in `out`.

    suites: names; empty for all. only: a text that a row's case/mode must hold. Rows of
    the same sources, machine and settings are kept. Ctrl-C leaves the rows finished so
    far. Gives the results and the files written beside them. Raises UserError for an
    unknown suite or a file in the way.
    """
    chosen = suites_named(suites)
    path = out / RESULTS_FILE
    results = Results() if fresh else load_results(path)
    limit_s = QUICK_LIMIT_S if quick else None
    wants = partial(holds, only)
    runner = Runner(results, path, progress, limit_s=limit_s, wants=wants)
    try:
        for done, (name, suite) in enumerate(chosen.items(), start=1):
            runner.run_suite(name, suite, quick, share=done / len(chosen))
    except KeyboardInterrupt:
        progress.say(f"Interrupted; {path} has {len(results.rows)} rows to go on from.")
        raise
    written = report_scaling(results.rows, out)
    return results, [path, *written, write_report(results, out / REPORT_FILE)]


def suites_named(names: Iterable[str]) -> dict[str, Suite]:
    """Return the suites of these names, all for none; UserError for an unknown one."""
    chosen = tuple(names) or tuple(SUITES)
    for name in chosen:
        if name not in SUITES:
            known = ", ".join(SUITES)
            raise UserError(f"there is no benchmark suite {name!r}; there are {known}")
    return {name: SUITES[name] for name in chosen}


def holds(text: str, task: Task) -> bool:
    """Return whether the text stands in a task's case/mode."""
    return text in f"{task.case}/{task.mode}"


class Runner:
    """Go through tasks and write the results file after each."""

    def __init__(
        self,
        results: Results,
        path: Path,
        progress: ProgressReporter,
        *,
        limit_s: float | None = None,
        wants: Callable[[Task], bool] | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """Drop rows that other sources or another machine made.

        limit_s: begin no task that would end later, counted from now. wants: tells
        which tasks to measure, with what they are compared with; None for all.
        """
        here, sources = machine(), commit()
        results.rows[:] = [
            row
            for row in results.rows
            if row.commit == sources and is_same_machine(row.machine, here)
        ]
        self._results = results
        self._path = path
        self._progress = progress
        self._clock = clock
        self._limit_s = limit_s
        self._wants = wants
        self._began = clock()
        self._end: float | None = None
        self._measured: dict[tuple[str, str, str], Row] = {}

    def run_suite(
        self, name: str, suite: Suite, quick: bool, *, share: float = 1.0
    ) -> None:
        """Measure what is not there yet, until `share` of the limit is over."""
        if self._limit_s is not None:
            self._end = self._began + share * self._limit_s
        skipped = self._results.skipped
        skipped[:] = [skip for skip in skipped if skip.suite != name]
        with closing(suite(quick)) as plan:
            tasks = plan.tasks()
            finished = {row.key for row in self._results.rows}
            wants = self._wants
            for done, task in enumerate(tasks):
                self._progress(f"Suite {name}", done / len(tasks))
                if task.key not in finished and (not wants or wants(task)):
                    self._measure(task, tasks)
        self._progress(f"Suite {name}", 1.0)

    def _measure(self, task: Task, tasks: list[Task]) -> None:
        if self._key(task) in self._measured:
            return
        baseline = None
        if task.baseline is not None:
            first = _baseline(task, tasks)
            # A kept baseline may be of a busier hour: a ratio is made of two
            # measurements of one run.
            self._measure(first, tasks)
            baseline = self._measured.get(self._key(first))
        if self._end is not None and self._clock() + task.cost_s > self._end:
            self._skip(task, "no time was left; run it again to go on")
            return
        try:
            made = task.measure()
        except UnavailableError as error:
            self._skip(task, str(error))
            return
        row = make_row(task, made, baseline)
        self._measured[self._key(task)] = row
        self._results.put(row)
        save_results(self._results, self._path)

    def _skip(self, task: Task, reason: str) -> None:
        skip = Skipped(suite=task.suite, case=task.case, mode=task.mode, reason=reason)
        if skip not in self._results.skipped:
            self._results.skipped.append(skip)
            save_results(self._results, self._path)

    @staticmethod
    def _key(task: Task) -> tuple[str, str, str]:
        return task.suite, task.case, task.mode


def make_row(task: Task, made: Measured, baseline: Row | None) -> Row:
    """Put a measurement into a row; without a baseline there is no ratio."""
    timing, error = made.timing, made.error
    own_s = timing.cpu_s if task.clock == "cpu" else timing.min_s
    baseline_s = None if baseline is None else baseline.seconds_by(task.clock)
    return Row(
        suite=task.suite,
        case=task.case,
        mode=task.mode,
        baseline=task.baseline,
        time_s=Times(min=timing.min_s, median=timing.median_s),
        cpu_s=timing.cpu_s,
        repeats=timing.repeats,
        clock=task.clock,
        baseline_s=baseline_s,
        ratio=None if baseline_s is None else ratio_of(baseline_s, own_s),
        error_unit=made.error_unit,
        rmse=None if error is None else error.rmse,
        p999=None if error is None else error.p999,
        max=None if error is None else error.max,
        bias=None if error is None else error.bias,
        further_rmse=made.further_rmse,
        counters=made.counters,
        settings=task.settings,
        machine=machine(),
        versions=versions(),
        commit=commit(),
    )


def _baseline(task: Task, tasks: list[Task]) -> Task:
    for other in tasks:
        if (other.case, other.mode) == (task.case, task.baseline):
            return other
    raise UserError(f"{task.case}: {task.mode} has no baseline {task.baseline!r}")
