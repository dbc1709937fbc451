"""A run goes on where it was killed, and compares only what it measured itself."""

from collections.abc import Callable
from functools import partial
from pathlib import Path

import msgspec
import pytest

from benchmarks.plan import Measured, Plan, Task, UnavailableError
from benchmarks.runner import Runner, holds, make_row, run_bench
from benchmarks.schema import Results, load_results, save_results
from benchmarks.timing import Timing
from renderers.scene import ImageError
from system import UserError
from tests.benchmarks.conftest import Unseen


class ThreeTasks(Plan):
    """A peer, ourselves beside it, and something alone; counts its measurements."""

    def __init__(self, calls: list[str], stop_at: str | None = None) -> None:
        self.calls = calls
        self.stop_at = stop_at
        self.closed = 0

    def __call__(self, quick: bool) -> "ThreeTasks":
        return self

    def close(self) -> None:
        self.closed += 1

    def tasks(self) -> list[Task]:
        return [
            self._task("peer", 0.4),
            self._task("own", 0.1, baseline="peer"),
            self._task("alone", 0.2),
        ]

    def _task(self, mode: str, seconds: float, baseline: str | None = None) -> Task:
        def measure() -> Measured:
            self.calls.append(mode)
            if mode == self.stop_at:
                raise KeyboardInterrupt
            timing = Timing(seconds, seconds, seconds / 2, 3)
            return Measured(timing, ImageError(1e-3, 2e-3, 3e-3, 0.0), "linear")

        return Task("s", "scene/view/wall", mode, measure, {"size": 8}, baseline)


def run(
    suite: ThreeTasks,
    path: Path,
    limit_s: float | None = None,
    clock: Callable[[], float] | None = None,
    only: str = "",
) -> Results:
    extra = {} if clock is None else {"clock": clock}
    results = load_results(path)
    wants = partial(holds, only)
    runner = Runner(results, path, Unseen(), limit_s=limit_s, wants=wants, **extra)
    runner.run_suite("s", suite, quick=True)
    return load_results(path)


def test_a_killed_run_continues(tmp_path: Path) -> None:
    path = tmp_path / "results.json"
    calls: list[str] = []
    killed = ThreeTasks(calls, stop_at="alone")
    with pytest.raises(KeyboardInterrupt):
        run(killed, path)
    assert calls == ["peer", "own", "alone"]
    assert killed.closed == 1
    assert [row.mode for row in load_results(path).rows] == ["peer", "own"]
    before = load_results(path).rows

    calls.clear()
    results = run(ThreeTasks(calls), path)
    assert calls == ["alone"]
    assert results.rows[:2] == before
    assert [row.mode for row in results.rows] == ["peer", "own", "alone"]

    calls.clear()
    assert run(ThreeTasks(calls), path) == results
    assert calls == []


def test_a_baseline_is_measured_again_for_a_row_that_needs_it(tmp_path: Path) -> None:
    path = tmp_path / "results.json"
    calls: list[str] = []
    with pytest.raises(KeyboardInterrupt):
        run(ThreeTasks(calls, stop_at="own"), path)
    calls.clear()
    results = run(ThreeTasks(calls), path)
    assert calls == ["peer", "own", "alone"]
    assert [row.mode for row in results.rows] == ["peer", "own", "alone"]


def test_rows_of_other_sources_are_measured_anew(tmp_path: Path) -> None:
    path = tmp_path / "results.json"
    calls: list[str] = []
    results = run(ThreeTasks(calls), path)
    old = [msgspec.structs.replace(row, commit="older") for row in results.rows]
    save_results(Results(rows=old), path)
    calls.clear()
    assert all(row.commit != "older" for row in run(ThreeTasks(calls), path).rows)
    assert calls == ["peer", "own", "alone"]


def test_the_ratio_is_the_baselines_time_over_ones_own(tmp_path: Path) -> None:
    results = run(ThreeTasks([]), tmp_path / "results.json")
    peer, own, alone = results.rows
    assert own.baseline_s == peer.cpu_s
    assert own.ratio == pytest.approx(4.0)
    assert (peer.ratio, alone.ratio) == (None, None)


def test_what_is_not_available_is_skipped_with_its_reason(tmp_path: Path) -> None:
    class NoPeer(ThreeTasks):
        def _task(self, mode: str, seconds: float, baseline: str | None = None) -> Task:
            if mode != "peer":
                return super()._task(mode, seconds, baseline)

            def fail() -> Measured:
                raise UnavailableError("no OpenGL here")

            return Task("s", "scene/view/wall", "peer", fail, {})

    path = tmp_path / "results.json"
    for _ in range(2):
        results = run(NoPeer([]), path)
        assert [(s.mode, s.reason) for s in results.skipped] == [
            ("peer", "no OpenGL here")
        ]
    own = results.rows[0]
    assert (own.mode, own.baseline, own.ratio) == ("own", "peer", None)


def test_nothing_begins_that_would_end_too_late(tmp_path: Path) -> None:
    path = tmp_path / "results.json"
    times = iter(range(0, 1000, 5))
    results = run(ThreeTasks([]), path, limit_s=12.0, clock=lambda: next(times))
    # the clock reads 5 before the first task of 6 s, 10 before the second
    assert [row.mode for row in results.rows] == ["peer"]
    assert {skip.mode for skip in results.skipped} == {"own", "alone"}
    results = run(ThreeTasks([]), path)
    assert len(results.rows) == 3
    assert results.skipped == []


def test_a_two_thread_row_is_compared_by_the_wall_clock() -> None:
    task = ThreeTasks([])._task("own", 0.1)
    made = task.measure()
    slower = Measured(Timing(0.3, 0.3, 0.6, 3))
    wall = Task("s", "c", "m", task.measure, {}, clock="wall")
    baseline = make_row(wall, slower, None)
    assert make_row(wall, made, baseline).ratio == pytest.approx(3.0)
    assert make_row(task, made, baseline).ratio == pytest.approx(12.0)


@pytest.mark.parametrize(
    ("only", "measured"),
    [
        ("", ["peer", "own", "alone"]),
        ("wall/own", ["peer", "own"]),
        ("peer", ["peer"]),
        ("no such row", []),
    ],
)
def test_rows_are_chosen_by_a_text_with_their_baselines(
    tmp_path: Path, only: str, measured: list[str]
) -> None:
    calls: list[str] = []
    run(ThreeTasks(calls), tmp_path / "results.json", only=only)
    assert calls == measured


def test_an_unknown_suite_is_refused_by_name(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"'tea'.*art, .*fsr, .*startup"):
        run_bench(
            suites=("tea",), quick=True, out=tmp_path, fresh=False, progress=Unseen()
        )


@pytest.mark.slow
def test_the_startup_suite_runs_from_end_to_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("benchmarks.runner.QUICK_LIMIT_S", 20.0)
    results, (stored, page) = run_bench(
        suites=("startup",), quick=True, out=tmp_path, fresh=True, progress=Unseen()
    )
    assert load_results(stored) == results
    assert page.is_file()
    assert {"python alone", "paravol --help"} <= {row.mode for row in results.rows}
