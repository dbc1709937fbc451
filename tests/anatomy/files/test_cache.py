import os
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from anatomy.files import cache
from anatomy.phantom.parameters import PhantomParameters

BOX = ((-12.0, 12.0), (0.0, 20.0), (0.0, 20.0))
HEAD = PhantomParameters(seed=9)


def test_the_second_call_reads_what_the_first_built(tmp_path: Path) -> None:
    stages: list[str] = []
    first = cache.sinus_phantom(HEAD, 2.0, field_mm=BOX, folder=tmp_path)
    second = cache.sinus_phantom(
        HEAD, 2.0, lambda stage, _: stages.append(stage), field_mm=BOX, folder=tmp_path
    )
    assert stages == ["reading the phantom from the cache"]
    for name in ("ct", "labels", "sides", "bone_cover", "distance", "blood", "skin"):
        a, b = getattr(first, name), getattr(second, name)
        assert np.array_equal(a.values, b.values)
        assert a.values.dtype == b.values.dtype
        assert np.array_equal(a.origin_mm, b.origin_mm)
        assert a.background == b.background
    assert first.landmarks.keys() == second.landmarks.keys()
    assert not list(tmp_path.glob("*.part"))


@pytest.mark.parametrize("harm", ["cut", "flip", "empty", "text"])
def test_a_broken_entry_is_built_again(tmp_path: Path, harm: str) -> None:
    first = cache.sinus_phantom(HEAD, 2.0, field_mm=BOX, folder=tmp_path)
    (entry,) = tmp_path.glob("*.npz")
    content = bytearray(entry.read_bytes())
    if harm == "cut":
        content = content[: len(content) // 2]
    elif harm == "flip":
        content[len(content) // 3] ^= 0x55
    elif harm == "empty":
        content = bytearray()
    else:
        content = bytearray(b"not a phantom")
    entry.write_bytes(content)
    again = cache.sinus_phantom(HEAD, 2.0, field_mm=BOX, folder=tmp_path)
    assert np.array_equal(first.ct.values, again.ct.values)
    assert np.array_equal(first.distance.values, again.distance.values)
    assert entry.read_bytes() != bytes(content)


def test_parameters_spacing_and_field_have_their_own_entries(tmp_path: Path) -> None:
    paths = {
        cache.entry_path(tmp_path, HEAD, 2.0, BOX),
        cache.entry_path(tmp_path, PhantomParameters(seed=10), 2.0, BOX),
        cache.entry_path(tmp_path, HEAD, 1.0, BOX),
        cache.entry_path(tmp_path, HEAD, 2.0, ((0.0, 4.0), (0.0, 4.0), (0.0, 4.0))),
    }
    assert len(paths) == 4


def test_callers_at_the_same_time_get_the_same_phantom(tmp_path: Path) -> None:
    def ask(_: int) -> bytes:
        found = cache.sinus_phantom(HEAD, 2.0, field_mm=BOX, folder=tmp_path, threads=1)
        return found.ct.values.tobytes()

    with ThreadPoolExecutor(4) as pool:
        assert len(set(pool.map(ask, range(6)))) == 1
    assert len(list(tmp_path.iterdir())) == 1


def test_a_folder_that_cannot_be_written_costs_only_time(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    blocker = tmp_path / "file"
    blocker.write_text("in the way")
    found = cache.sinus_phantom(HEAD, 2.0, field_mm=BOX, folder=blocker / "sub")
    assert found.ct.shape == (11, 11, 13)
    assert "could not be kept" in caplog.text


def test_old_entries_make_room(tmp_path: Path) -> None:
    for i in range(cache.ENTRIES_KEPT + 3):
        stale = tmp_path / f"old{i}.npz"
        stale.write_bytes(b"x")
        os.utime(stale, (i, i))
    cache.sinus_phantom(HEAD, 2.0, field_mm=BOX, folder=tmp_path)
    left = {p.name for p in tmp_path.glob("*.npz")}
    assert len(left) == cache.ENTRIES_KEPT
    assert cache.entry_path(tmp_path, HEAD, 2.0, BOX).name in left
    assert "old0.npz" not in left
