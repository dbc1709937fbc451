from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from renderers.snapshots.growing import FILE_NAME, GrowingPicture, Pixels, show
from renderers.snapshots.spool import Spool

JOB = "ab" * 16
WIDTH, HEIGHT = 20, 12


@pytest.fixture(scope="module")
def spool(tmp_path_factory: pytest.TempPathFactory) -> Spool:
    spool = Spool(tmp_path_factory.mktemp("growing") / "spool")
    (spool.job_folder(JOB) / "attempt-1").mkdir(parents=True)
    return spool


def noise(height: int, width: int, seed: int = 1) -> Pixels:
    return np.random.default_rng(seed).integers(
        0, 255, (height, width, 3), dtype=np.uint8
    )


def test_each_picture_is_read_once_and_the_next_attempt_s_follow(spool: Spool) -> None:
    picture = GrowingPicture(spool, JOB, WIDTH, HEIGHT)
    assert not picture.update()
    show(spool.attempt_folder(JOB), noise(HEIGHT, WIDTH))
    assert [picture.update(), picture.update()] == [True, False]
    assert np.array_equal(picture.pixels, noise(HEIGHT, WIDTH))
    show(spool.job_folder(JOB) / "attempt-2", noise(HEIGHT, WIDTH, 3))
    (spool.job_folder(JOB) / "attempt-2").mkdir()
    assert not picture.update(), "what was shown stays until there is more"
    assert np.array_equal(picture.pixels, noise(HEIGHT, WIDTH))
    show(spool.attempt_folder(JOB), noise(HEIGHT, WIDTH, 2))
    assert picture.update()
    assert np.array_equal(picture.pixels, noise(HEIGHT, WIDTH, 2))


@given(at=st.integers(0), flip=st.integers(0, 255))
def test_a_damaged_picture_is_never_shown(
    tmp_path_factory: pytest.TempPathFactory, at: int, flip: int
) -> None:
    """Whether a byte is another one or the file ends there."""
    spool = Spool(tmp_path_factory.mktemp("spool"))
    folder = spool.job_folder(JOB) / "attempt-1"
    folder.mkdir(parents=True)
    show(folder, noise(HEIGHT, WIDTH))
    file: Path = folder / FILE_NAME
    record = bytearray(file.read_bytes())
    at %= len(record)
    record[at] ^= flip
    file.write_bytes(record if flip else record[:at])
    picture = GrowingPicture(spool, JOB, WIDTH, HEIGHT)
    assert not picture.update()
    assert not picture.pixels.any()
