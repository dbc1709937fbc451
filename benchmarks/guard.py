"""The guard against getting slower or less right, beside the last release.

Every row is compared with its own baseline of the same run, and that ratio with the
release's: the middle one of `ROUNDS`. Of 290 rows of unchanged sources 21 scattered by
more than 10 % in these, one by 68 %, so each keeps its own scatter and is held to it. A
row's time is the least of its repeats, and one that fails is measured again with its
baseline: it has failed when it fails `TRIES` times.
"""

from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from rich.console import Console
from rich.table import Table

from benchmarks.machine import commit, is_same_machine, machine
from benchmarks.plan import ProgressReporter, Task
from benchmarks.ratios import (
    RELEASED,
    Key,
    Ratio,
    Ratios,
    best_of,
    load_ratios,
    middle_of,
    save_ratios,
)
from benchmarks.report import LOG_WIDTH
from benchmarks.runner import Runner, suites_named
from benchmarks.schema import Results
from system import UserError

SLOWER = 1.10
"""Times as long, beside the baseline, as in the release: more has failed, where the
release's own rounds did not scatter more."""

ROUNDS = 5
"""In which a release is measured."""

TRIES = 3
"""How often a row must fail."""

ERROR_SHARE, ERROR_LEAST = 1e-3, 1e-6
"""By how much an error may grow: bit noise. Pictures are float32, and an exponential
of another build moves single values by 4 eps, .5e-6, up or down. An RMSE grows by no
more than the RMS of what was added, some 1e-6, and where the signs are mixed by much
less: a thousandth covers depths in mm, whose eps is larger."""

GUARDED = (
    *("art", "art-classification", "art-ranks", "fsr", "light", "look", "skipping"),
    *("splats", "visibility"),
)
"""Suites of pictures: the same work at any time, on any machine."""


@dataclass(frozen=True, slots=True)
class Failure:
    """What got worse. before, now: the ratio, or the error `what`."""

    row: Ratio
    what: str
    before: float
    now: float


@dataclass(slots=True)
class Verdict:
    """What the comparison found; missing and new rows fail nothing.

    noisy: of those compared, what scattered by more than `SLOWER` in the release.
    """

    failures: list[Failure] = field(default_factory=list)
    missing: list[Ratio] = field(default_factory=list)
    new: list[Ratio] = field(default_factory=list)
    compared: int = 0
    noisy: int = 0


def compare(released: Iterable[Ratio], found: Iterable[Ratio]) -> Verdict:
    """Compare rows of the same measurement.

    A row that has lost its ratio or an error counts as missing: nothing was compared.
    """
    now = {row.key: row for row in found}
    verdict = Verdict()
    for before in released:
        row = now.pop(before.key, None)
        if row is None:
            verdict.missing.append(before)
            continue
        lost = before.ratio is not None and row.ratio is None
        if lost or before.errors.keys() - row.errors.keys():
            verdict.missing.append(before)
        verdict.compared += 1
        verdict.noisy += before.scatter > SLOWER
        verdict.failures += _failures(before, row)
    verdict.new = list(now.values())
    return verdict


def _failures(before: Ratio, now: Ratio) -> list[Failure]:
    found = []
    if (
        before.ratio is not None
        and now.ratio is not None
        and before.ratio / now.ratio > max(SLOWER, before.scatter)
    ):
        found.append(Failure(now, "ratio", before.ratio, now.ratio))
    for name, error in before.errors.items():
        allowed = error * (1 + ERROR_SHARE) + ERROR_LEAST
        # Not a number is no smaller error.
        if name in now.errors and not now.errors[name] <= allowed:
            found.append(Failure(now, name, error, now.errors[name]))
    return found


Measure = Callable[[Callable[[Task], bool] | None], Results]
"""Measures afresh the tasks that are wanted; all for None."""


def judge(released: Sequence[Ratio], measure: Measure) -> Verdict:
    """Measure all, and what fails again: the best of all counts."""
    runs = [measure(None)]
    verdict = compare(released, best_of(runs))
    if not verdict.compared:
        raise UserError("nothing that was measured stands in the release's ratios")
    while verdict.failures and len(runs) < TRIES:
        doubtful = {failure.row.key for failure in verdict.failures}
        again = measure(_among(doubtful))
        # Baselines measured again are in no doubt: only rows that failed are replaced.
        again.rows[:] = [row for row in again.rows if row.key in doubtful]
        runs.append(again)
        verdict = compare(released, best_of(runs))
    return verdict


def _among(keys: Collection[Key]) -> Callable[[Task], bool]:
    return lambda task: task.key in keys


def run_guard(
    suites: tuple[str, ...],
    file: Path | None,
    *,
    out: Path,
    store: bool,
    progress: ProgressReporter,
) -> Verdict | None:
    """Compare with a release; None where `store` keeps what later ones are held to.

    suites: names; empty for the release's, or those of pictures. Where rows of
    some are kept all else in the file stays. file: the release's
    ratios, None for those kept beside the sources. Quick sizes are measured. Raises
    UserError for an unknown suite and for a file that is absent or none.
    """
    file = file or RELEASED
    released = None if store else load_ratios(file)
    known = [] if released is None else released.rows
    rows = [row for row in known if not suites or row.suite in suites]
    chosen = suites_named(suites or dict.fromkeys(r.suite for r in rows) or GUARDED)

    def measure(wants: Callable[[Task], bool] | None) -> Results:
        results = Results()
        runner = Runner(results, out / "guard.json", progress, wants=wants)
        for name, suite in chosen.items():
            runner.run_suite(name, suite, quick=True)
        return results

    if released is None:
        kept = middle_of([measure(None) for _ in range(ROUNDS)])
        ratios = Ratios(machine=machine(), commit=commit(), rows=[])
        if suites and file.exists():
            ratios = load_ratios(file)
        rest = [row for row in ratios.rows if row.suite not in suites]
        ratios.rows = kept + rest
        save_ratios(ratios, file)
        progress.say(f"{file}: {len(kept)} rows to compare later sources with.")
        return None
    if not is_same_machine(released.machine, machine()):
        progress.say(f"The release was measured elsewhere: {released.machine.cpu}.")
    return judge(rows, measure)


def print_verdict(verdict: Verdict | None) -> int:
    """Tell what failed in a table, then what could not be compared; 1 for a failure.

    verdict: None where nothing was to be compared.
    """
    if verdict is None:
        return 0
    console = Console(width=LOG_WIDTH)
    if verdict.failures:
        table = Table(title="Slower, or less right, than the release", expand=True)
        for name in ("row", "what", "release", "now", "change"):
            table.add_column(name, overflow="fold")
        for failure in verdict.failures:
            table.add_row(*failure_cells(failure))
        console.print(table, highlight=False)
    for name, rows in (("Missing", verdict.missing), ("New", verdict.new)):
        for row in rows:
            console.print(f"{name}: {_name(row)}", highlight=False, soft_wrap=True)
    if verdict.noisy:
        console.print(
            f"{verdict.noisy} of them scattered by more than {SLOWER - 1:.0%} in the "
            "release: each is held to its own scatter."
        )
    console.print(
        f"{verdict.compared} rows compared, {len(verdict.failures)} failed, "
        f"{len(verdict.missing)} missing, {len(verdict.new)} new."
    )
    return 1 if verdict.failures else 0


def failure_cells(failure: Failure) -> tuple[str, str, str, str, str]:
    """Put a failure into words."""
    if failure.what == "ratio":
        change = f"{failure.before / failure.now - 1:.0%} slower beside "
        change += f"{failure.row.baseline}"
    else:
        change = f"{failure.now - failure.before:+.2e}"
    before, now = f"{failure.before:.4g}", f"{failure.now:.4g}"
    return _name(failure.row), failure.what, before, now, change


def _name(row: Ratio) -> str:
    return f"{row.suite}: {row.case}/{row.mode}"
