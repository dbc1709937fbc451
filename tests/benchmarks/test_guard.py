"""The guard fails what got slower or less right, twice, and tells the rest."""

import math
from collections.abc import Callable
from pathlib import Path

import msgspec
import pytest

from benchmarks.guard import (
    ERROR_LEAST,
    ERROR_SHARE,
    Verdict,
    compare,
    judge,
    print_verdict,
    run_guard,
)
from benchmarks.losslessness import DIFFER
from benchmarks.plan import Measured, Plan, Task
from benchmarks.ratios import RMSE, load_ratios, ratios_of, save_ratios
from benchmarks.schema import Results, Row
from benchmarks.timing import Timing
from renderers.scene import ImageError
from system import UserError
from tests.benchmarks.conftest import Unseen

replace = msgspec.structs.replace


def verdict_on(before: Row, *after: Row) -> Verdict:
    return compare(ratios_of([before]), ratios_of(after))


def slowed(row: Row, share: float) -> Row:
    assert row.ratio is not None
    return replace(row, ratio=row.ratio / (1 + share))


@pytest.mark.parametrize(
    ("share", "fails"), [(0.12, True), (0.08, False), (0.0, False), (-0.5, False)]
)
def test_twelve_percent_slower_fails_and_eight_passes(
    row: Row, share: float, fails: bool
) -> None:
    verdict = verdict_on(row, slowed(row, share))
    assert verdict.compared == 1
    assert [failure.what for failure in verdict.failures] == ["ratio"] * fails


def test_a_slower_machine_is_no_slower_row(row: Row) -> None:
    assert row.baseline_s is not None
    tired = replace(row, cpu_s=3 * row.cpu_s, baseline_s=3 * row.baseline_s)
    assert verdict_on(row, tired).failures == []


@pytest.mark.parametrize(
    ("change", "fails"),
    [
        (lambda rmse: rmse * 1.01, True),
        (lambda rmse: rmse + 1.01 * (ERROR_LEAST + ERROR_SHARE * rmse), True),
        (lambda rmse: rmse + 0.99 * (ERROR_LEAST + ERROR_SHARE * rmse), False),
        (lambda rmse: rmse / 2, False),
        (lambda rmse: math.nan, True),
    ],
)
def test_an_error_may_grow_by_bit_noise_only(
    row: Row, change: Callable[[float], float], fails: bool
) -> None:
    assert row.rmse is not None
    verdict = verdict_on(row, replace(row, rmse=change(row.rmse)))
    assert [failure.what for failure in verdict.failures] == [RMSE] * fails


def test_one_value_of_other_bits_fails(row: Row) -> None:
    lossless = replace(row, counters={DIFFER: 0.0})
    verdict = verdict_on(lossless, replace(row, counters={DIFFER: 1.0}))
    assert [failure.what for failure in verdict.failures] == [DIFFER]


def test_missing_and_new_rows_are_told_and_fail_nothing(
    row: Row, capsys: pytest.CaptureFixture[str]
) -> None:
    other = replace(row, mode="other")
    verdict = compare(ratios_of([row]), ratios_of([other]))
    assert verdict.failures == []
    assert [r.mode for r in verdict.missing] == [row.mode]
    assert [r.mode for r in verdict.new] == ["other"]
    print_verdict(verdict)
    said = capsys.readouterr().out
    assert f"Missing: art: phantom/inside/wall/{row.mode}" in said
    assert "New: art: phantom/inside/wall/other" in said
    assert "0 failed, 1 missing, 1 new" in said


@pytest.mark.parametrize("lost", [{"ratio": None}, {"rmse": None}])
def test_a_row_without_its_figure_is_missing(row: Row, lost: dict[str, None]) -> None:
    verdict = verdict_on(row, replace(row, **lost))
    assert [r.key for r in verdict.missing] == [row.key]


def test_failures_are_laid_out_in_a_table(
    row: Row, capsys: pytest.CaptureFixture[str]
) -> None:
    worse = replace(slowed(row, 0.25), rmse=2e-3)
    print_verdict(verdict_on(row, worse))
    said = capsys.readouterr().out
    assert "25% slower beside VTK, step 1" in said
    assert "+1.00e-03" in said
    assert "1 rows compared, 2 failed" in said


@pytest.mark.parametrize(("share", "fails"), [(0.31, True), (0.29, False)])
def test_a_row_that_scattered_is_held_to_its_scatter(
    row: Row, share: float, fails: bool, capsys: pytest.CaptureFixture[str]
) -> None:
    (released,) = ratios_of([row])
    released = replace(released, scatter=1.3)
    verdict = compare([released], ratios_of([slowed(row, share)]))
    assert [failure.what for failure in verdict.failures] == ["ratio"] * fails
    print_verdict(verdict)
    assert "1 of them scattered by more than 10%" in capsys.readouterr().out


@pytest.mark.parametrize(("again", "fails"), [(0.2, True), (0.05, False)])
def test_a_row_must_fail_three_times(row: Row, again: float, fails: bool) -> None:
    other = replace(row, mode="other")
    released = ratios_of([row, other])
    answers = iter(
        [[slowed(row, 0.2), other], [slowed(row, 0.3)], [slowed(row, again)]]
    )
    asked: list[Callable[[Task], bool] | None] = []

    def measure(wants: Callable[[Task], bool] | None) -> Results:
        asked.append(wants)
        return Results(rows=next(answers))

    verdict = judge(released, measure)
    assert bool(verdict.failures) == fails
    assert (verdict.compared, verdict.missing) == (2, [])
    first, second, third = asked
    assert first is None
    assert second is not None
    assert third is not None
    tasks = [
        Task(r.suite, r.case, r.mode, lambda: Measured(Timing(1, 1, 1, 1)), r.settings)
        for r in (row, other)
    ]
    for wants in (second, third):
        assert [wants(task) for task in tasks] == [True, False]


def test_what_passes_is_measured_once(row: Row) -> None:
    calls = iter([Results(rows=[row])])
    assert judge(ratios_of([row]), lambda wants: next(calls)).compared == 1


def test_nothing_to_compare_is_no_success(row: Row) -> None:
    with pytest.raises(ValueError, match="nothing that was measured"):
        judge(ratios_of([row]), lambda wants: Results())


@pytest.fixture
def paces(monkeypatch: pytest.MonkeyPatch) -> dict[str, float]:
    """A suite of two rows, the seconds of which the test sets."""
    seconds = {"peer": 0.4, "own": 0.1}

    class TwoTasks(Plan):
        suite = "two"

        def __init__(self, quick: bool) -> None:
            assert quick
            super().__init__(quick)

        def tasks(self) -> list[Task]:
            return [self._one("peer", None), self._one("own", "peer")]

        def _one(self, mode: str, baseline: str | None) -> Task:
            def measure() -> Measured:
                timing = Timing(seconds[mode], seconds[mode], seconds[mode], 3)
                return Measured(timing, ImageError(1e-3, 2e-3, 3e-3, 0.0), "linear")

            return self.task("a/b/c", mode, measure, {}, baseline)

    monkeypatch.setattr("benchmarks.runner.SUITES", {"two": TwoTasks})
    return seconds


def test_a_release_is_stored_and_later_sources_are_held_to_it(
    paces: dict[str, float], tmp_path: Path
) -> None:
    file = tmp_path / "ratios.json"

    def guard(store: bool) -> Verdict | None:
        return run_guard(
            ("two",) if store else (),
            file,
            out=tmp_path / "out",
            store=store,
            progress=Unseen(),
        )

    assert guard(True) is None
    kept = load_ratios(file).rows
    assert [row.mode for row in kept] == ["peer", "own"]
    for pace, changes in (("", 0), ("own", 1), ("peer", 0)):
        if pace:
            paces[pace] *= 1.12
        verdict = guard(False)
        assert verdict is not None
        assert (verdict.compared, len(verdict.failures)) == (2, changes)
    assert load_ratios(file).rows == kept
    # one suite anew: what is kept of others stays
    ratios = load_ratios(file)
    ratios.rows.append(msgspec.structs.replace(kept[0], suite="three"))
    ratios.commit = "that of the release"
    save_ratios(ratios, file)
    assert guard(True) is None
    after = load_ratios(file)
    assert [row.suite for row in after.rows] == ["two", "two", "three"]
    assert after.commit == ratios.commit


def test_an_unknown_suite_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "r"
    with pytest.raises(UserError, match="'tea'"):
        run_guard(("tea",), file, out=tmp_path, store=True, progress=Unseen())
