"""Ratios survive the disk; of two runs the better is kept."""

from pathlib import Path

import msgspec
import pytest

from benchmarks.losslessness import DIFFER
from benchmarks.ratios import (
    RMSE,
    Ratios,
    best_of,
    load_ratios,
    middle_of,
    ratios_of,
    save_ratios,
)
from benchmarks.schema import Results, Row


def test_what_is_stored_comes_back(row: Row, tmp_path: Path) -> None:
    kept = Ratios(machine=row.machine, commit="abc", rows=ratios_of([row]))
    path = tmp_path / "deep" / "ratios.json"
    save_ratios(kept, path)
    assert load_ratios(path) == kept
    assert kept.rows[0].key == row.key
    assert kept.rows[0].errors == {RMSE: row.rmse}


def test_only_what_can_be_compared_is_kept(row: Row) -> None:
    bare = msgspec.structs.replace(row, ratio=None, rmse=None)
    counted = msgspec.structs.replace(bare, counters={DIFFER: 0.0, "samples": 3.0})
    assert ratios_of([bare]) == []
    (found,) = ratios_of([counted])
    assert (found.ratio, found.errors) == (None, {DIFFER: 0.0})


def test_the_better_of_two_runs_is_kept(row: Row) -> None:
    again = msgspec.structs.replace(row, ratio=1.5, rmse=5e-4)
    (found,) = best_of([Results(rows=[row]), Results(rows=[again])])
    assert (found.ratio, found.errors[RMSE]) == (2.0, 5e-4)


def test_the_middle_of_a_releases_rounds_is_kept_with_its_scatter(row: Row) -> None:
    rounds = [msgspec.structs.replace(row, ratio=r) for r in (2.0, 1.0, 1.6, 1.5, 1.2)]
    (found,) = middle_of([Results(rows=[one]) for one in rounds])
    assert (found.ratio, found.scatter) == (1.5, 2.0)
    bare = msgspec.structs.replace(row, ratio=None)
    (found,) = middle_of([Results(rows=[bare])])
    assert (found.ratio, found.scatter) == (None, 1.0)


@pytest.mark.parametrize("text", ["", "[]", '{"rows": 3}'])
def test_other_files_are_refused(text: str, tmp_path: Path) -> None:
    path = tmp_path / "ratios.json"
    with pytest.raises(ValueError, match="--store"):
        load_ratios(path)
    path.write_text(text)
    with pytest.raises(ValueError, match="does not hold ratios"):
        load_ratios(path)
