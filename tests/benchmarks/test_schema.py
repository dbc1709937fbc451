"""Results survive the disk, and a ratio is a ratio of times."""

import math
from pathlib import Path

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.schema import (
    Results,
    Row,
    Skipped,
    Times,
    load_results,
    ratio_of,
    results_text,
    row_key,
    save_results,
)

SECONDS = st.floats(1e-6, 1e6)


def test_results_come_back_as_they_were(row: Row, tmp_path: Path) -> None:
    busier = msgspec.structs.replace(row.machine, load=2.0)
    plain = msgspec.structs.replace(
        row, mode="b", rmse=None, ratio=None, machine=busier, further_rmse={"of x": 0.1}
    )
    skip = Skipped(suite="fsr", case="c", mode="m", reason="no OpenGL")
    results = Results(rows=[row, plain], skipped=[skip])
    path = tmp_path / "deep" / "results.json"
    save_results(results, path)
    assert load_results(path) == results
    assert [file.name for file in path.parent.iterdir()] == ["results.json"]


def test_machine_and_sources_are_told_once(row: Row) -> None:
    busier = msgspec.structs.replace(row.machine, load=2.0)
    rows = [
        row,
        msgspec.structs.replace(row, mode="b", machine=busier),
        msgspec.structs.replace(row, mode="c", commit="def"),
    ]
    text = results_text(Results(rows=rows))
    assert text.count('"abc"') == text.count('"def"') == 1
    assert len([line for line in text.splitlines() if '"mode"' in line]) == len(rows)


def test_numbers_of_numpy_are_kept(row: Row, tmp_path: Path) -> None:
    told = {"median_us": np.float64(12.5)}
    path = tmp_path / "results.json"
    save_results(Results(rows=[msgspec.structs.replace(row, counters=told)]), path)
    assert load_results(path).rows[0].counters == {"median_us": 12.5}


def test_an_absent_file_is_an_empty_one(tmp_path: Path) -> None:
    assert load_results(tmp_path / "results.json") == Results()


@pytest.mark.parametrize("text", ["", "[]", '{"rows": 3}', '{"schema_version": 999}'])
def test_other_files_are_refused_by_name(text: str, tmp_path: Path) -> None:
    path = tmp_path / "results.json"
    path.write_text(text)
    with pytest.raises(ValueError, match=r"results\.json .*--fresh"):
        load_results(path)


def test_a_measurement_made_again_takes_the_old_ones_place(row: Row) -> None:
    results = Results()
    other = msgspec.structs.replace(row, mode="another")
    results.put(row)
    results.put(other)
    again = msgspec.structs.replace(row, cpu_s=1.0)
    results.put(again)
    assert results.rows == [again, other]


def test_the_key_does_not_depend_on_the_order_of_settings() -> None:
    a = row_key("s", "c", "m", {"x": 1, "y": 2.5})
    assert a == row_key("s", "c", "m", {"y": 2.5, "x": 1})
    assert a != row_key("s", "c", "m", {"y": 2.5, "x": 2})


@given(SECONDS, SECONDS)
def test_twice_as_fast_is_a_ratio_of_two(baseline_s: float, own_s: float) -> None:
    assert ratio_of(baseline_s, own_s) * own_s == pytest.approx(baseline_s)
    assert ratio_of(baseline_s, own_s / 2) == pytest.approx(
        2 * ratio_of(baseline_s, own_s)
    )
    assert ratio_of(own_s, own_s) == 1
    assert ratio_of(baseline_s, own_s) * ratio_of(own_s, baseline_s) == pytest.approx(1)


@pytest.mark.parametrize("bad", [0.0, -1.0, math.inf, math.nan])
def test_no_time_makes_no_ratio(bad: float) -> None:
    with pytest.raises(ValueError, match="positive seconds"):
        ratio_of(1.0, bad)
    with pytest.raises(ValueError, match="positive seconds"):
        ratio_of(bad, 1.0)


def test_each_clock_reads_its_own_time(row: Row) -> None:
    assert row.seconds_by("cpu") == row.cpu_s == row.seconds
    assert row.seconds_by("wall") == row.time_s.min


def test_a_median_far_above_the_minimum_is_noise(row: Row) -> None:
    assert not row.is_noisy
    disturbed = Times(min=0.1, median=0.13)
    assert msgspec.structs.replace(row, time_s=disturbed).is_noisy
