"""What looks for failing readers finds those that fail on purpose."""

import importlib.util
from pathlib import Path

import pytest

from tests.stress.fuzz import try_reader

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(
        importlib.util.find_spec("atheris") is None, reason="atheris is not installed"
    ),
]

BROKEN = "tests.stress.broken_readers"


@pytest.mark.parametrize(
    ("name", "kept"),
    [("raising", "crash-"), ("hanging", "timeout-"), ("growing", "oom-")],
)
def test_a_reader_that_fails_is_found_and_its_input_kept(
    tmp_path: Path, name: str, kept: str
) -> None:
    assert not try_reader(BROKEN, name, 60, tmp_path)
    assert list((tmp_path / name).glob(f"{kept}*"))


def test_a_sound_reader_is_told_so(tmp_path: Path) -> None:
    assert try_reader("tests.stress.foreign_readers", "trackers", 2, tmp_path)
