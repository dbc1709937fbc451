from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from renderers.art.regions import Region
from renderers.snapshots.growing import FILE_NAME, GrowingPicture, Pixels, TileWriter
from renderers.snapshots.spool import Spool

JOB = "ab" * 16
WIDTH, HEIGHT = 20, 12
WHOLE = Region(0, 0, WIDTH, HEIGHT)
PARTS = [Region(0, 0, 8, 8), Region(8, 0, 16, 8), Region(16, 4, 20, 12)]


@pytest.fixture(scope="module")
def spool(tmp_path_factory: pytest.TempPathFactory) -> Spool:
    spool = Spool(tmp_path_factory.mktemp("growing") / "spool")
    spool.job_folder(JOB).mkdir()
    return spool


def noise(height: int, width: int, seed: int = 1) -> Pixels:
    return np.random.default_rng(seed).integers(
        0, 255, (height, width, 3), dtype=np.uint8
    )


@pytest.fixture(scope="module")
def record(spool: Spool) -> bytes:
    """Get the file of a coarse picture and three parts of the fine one."""
    folder = spool.attempt_folder(JOB, 9)
    folder.mkdir()
    writer = TileWriter(folder)
    writer.add(WHOLE, noise(3, 5))
    fine = noise(HEIGHT, WIDTH)
    for part in PARTS:
        writer.add(part, fine[part.rows, part.columns])
    writer.close()
    record = (folder / FILE_NAME).read_bytes()
    (folder / FILE_NAME).unlink()
    return record


def read(spool: Spool, *stages: bytes) -> tuple[Pixels, list[bool]]:
    """Show a client what the file was at each of its looks."""
    picture = GrowingPicture(spool, JOB, WIDTH, HEIGHT)
    told = []
    for stage in stages:
        (spool.attempt_folder(JOB) / FILE_NAME).write_bytes(stage)
        told.append(picture.update())
    return picture.pixels, told


def test_parts_are_shown_as_they_are_and_the_rest_is_coarse(
    spool: Spool, record: bytes
) -> None:
    pixels, told = read(spool, record, record)
    assert told == [True, False]
    fine = noise(HEIGHT, WIDTH)
    rest = np.ones((HEIGHT, WIDTH), bool)
    for part in PARTS:
        place = part.rows, part.columns
        assert np.array_equal(pixels[place], fine[place])
        rest[place] = False
    coarse, _ = read(spool, record[: 32 + 45])
    assert np.array_equal(pixels[rest], coarse[rest])
    # Bilinear: within the range of the coarse picture's own values.
    assert coarse.min() >= noise(3, 5).min()
    assert coarse.max() <= noise(3, 5).max()


@given(st.data())
def test_it_does_not_matter_when_one_looks(
    spool: Spool, record: bytes, data: st.DataObject
) -> None:
    """Cut anywhere, even in the middle of records, it ends in the same picture."""
    cuts = data.draw(st.lists(st.integers(0, len(record)), max_size=6))
    pixels, told = read(spool, *(record[:cut] for cut in sorted(cuts)), record)
    expected, _ = read(spool, record)
    assert np.array_equal(pixels, expected)
    assert any(told)


@example(at=4, flip=1)
@given(at=st.integers(0, 100_000), flip=st.integers(1, 255))
def test_a_damaged_record_is_never_shown(
    spool: Spool, record: bytes, at: int, flip: int
) -> None:
    at %= len(record)
    damaged = bytearray(record)
    damaged[at] ^= flip
    pixels, _ = read(spool, bytes(damaged))
    ends = np.cumsum([32 + 45, *(32 + 3 * part.pixels for part in PARTS)])
    whole = int(np.searchsorted(ends, at, side="right"))
    expected, _ = read(spool, record[: ([0, *ends])[whole]])
    assert np.array_equal(pixels, expected)


def test_another_attempt_is_shown_from_its_beginning(
    tmp_path: Path, record: bytes
) -> None:
    spool = Spool(tmp_path / "spool")
    spool.job_folder(JOB).mkdir()
    picture = GrowingPicture(spool, JOB, WIDTH, HEIGHT)
    assert not picture.update()
    (spool.job_folder(JOB) / "attempt-1").mkdir()
    (spool.attempt_folder(JOB) / FILE_NAME).write_bytes(record)
    assert picture.update()
    before = picture.pixels.copy()
    (spool.job_folder(JOB) / "attempt-2").mkdir()
    assert not picture.update(), "what was shown stays until there is more"
    second = TileWriter(spool.attempt_folder(JOB))
    second.add(PARTS[0], noise(8, 8, 5))
    second.close()
    assert picture.update()
    assert np.array_equal(picture.pixels[:8, :8], noise(8, 8, 5))
    assert np.array_equal(picture.pixels[8:], before[8:])
