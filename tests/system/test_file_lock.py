"""A lock excludes others, and ends with its process, however that ends."""

import builtins
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from system import NoLocksError, lock_file, locked

HOLD = """
import os, sys
from system import lock_file
lock_file(os.open(sys.argv[1], os.O_RDWR), waits=False)
print("held", flush=True)
sys.stdin.read()
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "kept"
    path.write_text("what it says")
    return path


def is_free(path: Path) -> bool:
    handle = os.open(path, os.O_RDWR)
    try:
        lock_file(handle, waits=False)
    except BlockingIOError:
        return False
    finally:
        os.close(handle)
    return True


def test_a_lock_excludes_others_until_its_file_is_closed(file: Path) -> None:
    handle = os.open(file, os.O_RDWR)
    lock_file(handle, waits=False)
    assert not is_free(file)
    os.close(handle)
    assert is_free(file)
    assert file.read_text() == "what it says"


def test_a_killed_process_leaves_no_lock(file: Path) -> None:
    with subprocess.Popen(
        [sys.executable, "-c", HOLD, str(file)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
    ) as child:
        assert child.stdout is not None
        assert child.stdout.readline() == b"held\n"
        assert not is_free(file)
        child.kill()
        child.wait()
    assert is_free(file)


def test_who_is_inside_is_alone(file: Path) -> None:
    with locked(file):
        assert not is_free(file)
    assert is_free(file)
    with pytest.raises(FileNotFoundError), locked(file.with_name("none")):
        pass
    with locked(file.with_name("new"), creates=True):
        pass
    assert file.with_name("new").exists()


def test_without_locks_one_is_told_and_nobody_waits(
    file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = builtins.__import__

    def without(name: str, *rest: Any) -> Any:
        if name == "fcntl":
            raise ModuleNotFoundError(name)
        return real(name, *rest)

    monkeypatch.setattr(builtins, "__import__", without)
    with file.open() as opened, pytest.raises(NoLocksError):
        lock_file(opened.fileno(), waits=False)
    with locked(file), locked(file):
        pass
