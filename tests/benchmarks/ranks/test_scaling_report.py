from pathlib import Path

from benchmarks.machine import machine
from benchmarks.ranks.scaling_report import knee, report_scaling
from benchmarks.schema import Row, Times


def make_row(case: str, mode: str, ranks: int, **counters: float) -> Row:
    return Row(
        suite="art-scaling",
        case=case,
        mode=mode,
        baseline=None,
        time_s=Times(min=1.0, median=1.0),
        cpu_s=1.0,
        repeats=1,
        clock="cpu",
        baseline_s=None,
        ratio=None,
        error_unit=None,
        rmse=None,
        p999=None,
        max=None,
        bias=None,
        counters=counters,
        settings={"ranks": ranks, "side": 128},
        machine=machine(),
        versions={},
        commit="x",
    )


def caches() -> list[Row]:
    times = {1.5: 620.0, 2.0: 571.0, 3.0: 563.0, 4.0: 560.0}
    return [
        make_row("figure4/a/t3d", f"cache {c}", 8, cache=c, simulated_s=s)
        for c, s in times.items()
    ]


def test_the_knee_is_the_smallest_cache_near_the_plateau() -> None:
    assert knee(caches()) == 2.0
    assert knee(caches()[::-1]) == 2.0


def test_a_report_stands_beside_the_paper(tmp_path: Path) -> None:
    table = make_row(
        "table1/128, 1.41 edges across/t3d",
        "8 ranks",
        8,
        simulated_s=283.4,
        paper_s=281.0,
        efficiency=0.951,
        paper_efficiency=0.958,
    )
    strong = make_row("strong/512/t3d", "64 ranks", 64, efficiency=0.9)
    ways = make_row("ways/16 ranks/t3d", "static homes", 16, simulated_s=9.4)
    text, picture = report_scaling([table, *caches(), strong, ways], tmp_path)
    lines = text.read_text().splitlines()
    assert any(line.startswith("| 8 ranks | 283 | 281 | 95.1%") for line in lines)
    assert any("Knee 2 volumes" in line for line in lines)
    assert "ranks 8, side 128" in lines
    assert picture.stat().st_size > 10_000


def test_without_rows_nothing_is_written(tmp_path: Path) -> None:
    assert report_scaling([], tmp_path) == []
    assert not list(tmp_path.iterdir())
