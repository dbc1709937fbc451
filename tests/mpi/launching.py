"""Ranks that a test starts, by the launcher that PARAVOL_MPIEXEC names or there is."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path

import pytest

from renderers.snapshots.launcher import Launcher, find_launcher

LAUNCHER = find_launcher()

NEEDS_RANKS = [
    pytest.mark.mpi,
    pytest.mark.skipif(find_spec("mpi4py") is None, reason="there is no mpi4py"),
    pytest.mark.skipif(LAUNCHER is None, reason="there is no mpiexec"),
]
"""Marks of a module whose tests start ranks."""

ROOT = Path(__file__).parents[2]


def ranks_command(
    number: int, *words: str, launcher: Launcher | None = None
) -> list[str]:
    """Give the command that runs Python so often, with these words behind it."""
    launcher = launcher or LAUNCHER
    assert launcher is not None
    return [*launcher.command(number), sys.executable, "-m", "mpi4py", *words]


@contextmanager
def running(command: list[str]) -> Iterator["subprocess.Popen[str]"]:
    """Run a command in a session of its own; what is left in the end is killed."""
    child = subprocess.Popen(
        command,
        cwd=ROOT,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
    )
    try:
        yield child
    finally:
        if child.poll() is None:
            os.killpg(child.pid, signal.SIGKILL)
        child.communicate()


@contextmanager
def ranks(
    number: int, spool: Path, *options: str, launcher: Launcher | None = None
) -> Iterator["subprocess.Popen[str]"]:
    """Run a worker of so many ranks on a spool."""
    words = ["-m", "renderers.snapshots", "--spool", str(spool), *options]
    with running(ranks_command(number, *words, launcher=launcher)) as child:
        yield child


def run_two(program: str, folder: Path) -> "subprocess.CompletedProcess[str]":
    """Run a program of two ranks, which gets a folder, to its end."""
    return subprocess.run(
        ranks_command(2, "-c", program, str(folder)),
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
        cwd=ROOT,
    )


def processes_of(spool: Path) -> list[int]:
    """List living processes whose command line names a spool."""
    found = []
    for entry in Path("/proc").glob("[0-9]*"):
        try:
            words = (entry / "cmdline").read_bytes().split(b"\0")
            state = (entry / "stat").read_text().rpartition(")")[2].split()[0]
        except OSError:
            continue
        if str(spool).encode() in words and state != "Z":
            found.append(int(entry.name))
    return found


def wait_until_gone(spool: Path, seconds: float = 30) -> None:
    """Wait until no process names a spool any more."""
    deadline = time.monotonic() + seconds
    while processes_of(spool):
        assert time.monotonic() < deadline, "processes were left behind"
        time.sleep(0.1)


def rank_process(spool: Path, number: int) -> int:
    """Find a rank's process by what its launcher told it."""
    names = (b"PMI_RANK", b"OMPI_COMM_WORLD_RANK")
    for pid in processes_of(spool):
        told = (Path("/proc") / str(pid) / "environ").read_bytes().split(b"\0")
        if any(name + b"=%d" % number in told for name in names):
            return pid
    raise AssertionError(f"there is no rank {number}")
