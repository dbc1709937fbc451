"""Ranks of one machine, here threads: one memory, each part done once."""

import gc
import os

import numpy as np
import pytest

from renderers.art.crew import ALONE, MachineCrew
from tests.renderers.art.threaded_crew import RANKS, together


@pytest.mark.parametrize("shape", [7, (3, 5), (0,), (40, 50, 60)])
def test_what_one_writes_all_see(shape: int | tuple[int, ...]) -> None:
    def work(crew: MachineCrew) -> np.ndarray:
        room = crew.empty(shape, np.int32)
        flat = room.reshape(-1)

        def write(place: int) -> None:
            flat[place] += place + 1

        crew.share(write, range(flat.size))
        crew.once(lambda: np.add(flat, 1, flat))
        return room.copy()

    found = together(work)
    size = int(np.prod(shape))
    for room in found:
        assert np.array_equal(room.ravel(), np.arange(2, size + 2))


def test_memory_is_freed_by_whoever_lets_go_last() -> None:
    """No file stays open, and none is left."""
    gc.collect()
    before = len(os.listdir("/proc/self/fd"))
    rooms = together(lambda crew: crew.empty(100_000, np.float32))
    assert len(os.listdir("/proc/self/fd")) <= before + RANKS  # one each by mmap
    rooms[0][:] = 3.0
    last = rooms.pop()
    del rooms
    gc.collect()
    assert last[99_999] == 3.0
    del last
    gc.collect()
    assert len(os.listdir("/proc/self/fd")) == before


def test_without_memory_of_its_own_a_system_takes_a_file(
    monkeypatch: pytest.MonkeyPatch, tmp_path: "os.PathLike[str]"
) -> None:
    monkeypatch.delattr(os, "memfd_create")
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    rooms = together(lambda crew: crew.empty((4, 4), np.int64))
    rooms[1][2, 3] = 9
    assert all(room[2, 3] == 9 for room in rooms)
    assert not os.listdir(tmp_path)


def test_one_that_is_alone_does_everything() -> None:
    done: list[int] = []
    ALONE.share(done.append, range(5))
    ALONE.once(lambda: done.append(9))
    assert done == [0, 1, 2, 3, 4, 9]
    assert ALONE.agree(True)
    assert not ALONE.agree(False)
