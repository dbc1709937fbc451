from pathlib import Path

import numpy as np
import pytest

from renderers.fsr.surfels import SurfelRasterizer
from renderers.fsr.visibility import BlockBounds, VisibleSets
from renderers.fsr.visibility.visible_set_store import (
    ENTRIES_KEPT,
    entry_path,
    stored_visible_sets,
)
from renderers.scene import Volume
from renderers.scene.thread_pool import ThreadPool


@pytest.fixture(scope="module")
def bounds(cavities: Volume) -> BlockBounds:
    return SurfelRasterizer(cavities).bounds()


def same(a: VisibleSets, b: VisibleSets) -> bool:
    return a.shape == b.shape and all(
        np.array_equal(getattr(a, name), getattr(b, name))
        for name in ("table", "numbers", "bits")
    )


def test_what_is_kept_is_read_back(
    cavities: Volume, bounds: BlockBounds, pool: ThreadPool, tmp_path: Path
) -> None:
    built: list[float] = []
    first = stored_visible_sets(
        cavities, bounds, pool, folder=tmp_path, progress=built.append
    )
    assert len(built) == len(first.bits)
    again = stored_visible_sets(
        cavities, bounds, pool, folder=tmp_path, progress=built.append
    )
    assert len(built) == len(first.bits), "nothing was built"
    assert same(first, again)
    assert [p.name for p in tmp_path.iterdir()] == [
        entry_path(tmp_path, cavities, bounds).name
    ]


@pytest.mark.parametrize("damage", ["empty", "cut", "text", "other"])
def test_a_broken_entry_is_made_again(
    cavities: Volume,
    bounds: BlockBounds,
    pool: ThreadPool,
    tmp_path: Path,
    caplog: pytest.LogCaptureFixture,
    damage: str,
) -> None:
    first = stored_visible_sets(cavities, bounds, pool, folder=tmp_path)
    path = entry_path(tmp_path, cavities, bounds)
    content = path.read_bytes()
    if damage == "other":
        with path.open("wb") as file:
            np.savez(
                file,
                shape=np.array(first.shape),
                table=first.table,
                numbers=first.numbers[1:],
                bits=first.bits,
            )
    else:
        spoilt = {"empty": b"", "cut": content[: len(content) // 2], "text": b"sets"}
        path.write_bytes(spoilt[damage])
    assert same(first, stored_visible_sets(cavities, bounds, pool, folder=tmp_path))
    assert "are made again" in caplog.text
    assert path.read_bytes() == content


def test_the_name_tells_the_content(
    cavities: Volume, bounds: BlockBounds, tmp_path: Path
) -> None:
    values = cavities.values.copy()
    values[3, 3, 3] += 0.01
    other = cavities.with_values(values, cavities.background)
    moved = BlockBounds(bounds.numbers, bounds.places, bounds.cells + 1)
    names = {
        entry_path(tmp_path, cavities, bounds),
        entry_path(tmp_path, other, bounds),
        entry_path(tmp_path, cavities, moved),
    }
    assert len(names) == 3


def test_a_folder_that_cannot_be_written_costs_nothing_but_time(
    cavities: Volume,
    bounds: BlockBounds,
    pool: ThreadPool,
    tmp_path: Path,
    caplog: pytest.LogCaptureFixture,
) -> None:
    (tmp_path / "taken").write_text("a file where the folder should be")
    sets = stored_visible_sets(cavities, bounds, pool, folder=tmp_path / "taken")
    assert len(sets.bits) > 0
    assert "could not be kept" in caplog.text


def test_old_entries_are_removed(
    cavities: Volume, bounds: BlockBounds, pool: ThreadPool, tmp_path: Path
) -> None:
    for n in range(ENTRIES_KEPT + 3):
        (tmp_path / f"{n}.npz").write_bytes(b"old")
    stored_visible_sets(cavities, bounds, pool, folder=tmp_path)
    assert len(list(tmp_path.glob("*.npz"))) == ENTRIES_KEPT
    assert entry_path(tmp_path, cavities, bounds).exists()
