from pathlib import Path
from typing import Any

import pytest

from renderers.snapshots.shared_files import write_whole


def test_a_file_is_replaced_whole(tmp_path: Path) -> None:
    path = tmp_path / "file"
    write_whole(path, b"one")
    write_whole(path, memoryview(b"two, longer"))
    assert path.read_bytes() == b"two, longer"
    assert list(tmp_path.iterdir()) == [path]


def test_a_failure_leaves_the_old_file_and_nothing_else(tmp_path: Path) -> None:
    path = tmp_path / "file"
    write_whole(path, b"one")
    text: Any = "text"
    with pytest.raises(TypeError):
        write_whole(path, text)
    assert path.read_bytes() == b"one"
    assert list(tmp_path.iterdir()) == [path]
