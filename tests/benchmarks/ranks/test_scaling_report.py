from collections.abc import Callable
from pathlib import Path

import pytest
from msgspec.structs import replace

from benchmarks.ranks.scaling_report import knee, report_scaling
from benchmarks.schema import Row

Make = Callable[..., Row]


@pytest.fixture
def make(row: Row) -> Make:
    def made(case: str, mode: str, ranks: int, **counters: float) -> Row:
        return replace(
            row,
            suite="art-scaling",
            case=case,
            mode=mode,
            counters=counters,
            settings={"ranks": ranks, "side": 128},
        )

    return made


def caches(make: Make) -> list[Row]:
    times = {1.5: 620.0, 2.0: 571.0, 3.0: 563.0, 4.0: 560.0}
    return [
        make("figure4/a/t3d", f"cache {c}", 8, cache=c, simulated_s=s)
        for c, s in times.items()
    ]


def test_the_knee_is_the_smallest_cache_near_the_plateau(make: Make) -> None:
    assert knee(caches(make)) == 2.0
    assert knee(caches(make)[::-1]) == 2.0


def test_a_report_stands_beside_the_paper(tmp_path: Path, make: Make) -> None:
    table = make(
        "table1/128, 1.41 edges across/t3d",
        "8 ranks",
        8,
        simulated_s=283.4,
        paper_s=281.0,
        efficiency=0.951,
        paper_efficiency=0.958,
    )
    ways = make("ways/16 ranks/t3d", "static homes", 16, simulated_s=9.4)
    text, picture = report_scaling([table, *caches(make), ways], tmp_path)
    lines = text.read_text().splitlines()
    assert any(
        line.startswith("| 8 ranks | 283.4 | 281 | 95.1% | 95.8% |") for line in lines
    )
    assert any("Knee 2 volumes" in line for line in lines)
    assert "ranks 8, side 128" in lines
    assert picture.stat().st_size > 10_000


def test_without_rows_nothing_is_written(tmp_path: Path) -> None:
    assert report_scaling([], tmp_path) == []
    assert not list(tmp_path.iterdir())
