"""The snapshot worker as child processes: started, watched, ended."""

import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from app.faults import ToldError

STOP_S = 5.0


def mpiexec() -> str | None:
    """Find the MPI launcher: beside this Python first, then on the path."""
    beside = Path(sys.executable).with_name("mpiexec")
    if beside.exists():
        return str(beside)
    return shutil.which("mpiexec")


def worker_command(spool: Path, *, ranks: int, once: bool) -> list[str]:
    """Give the command line that serves `spool` with so many ranks.

    Raises ToldError when ranks are wanted and there is no MPI.
    """
    if ranks < 1:
        raise ValueError(f"--ranks must be at least 1, got {ranks}")
    tail = ["renderers.art", "--spool", str(spool), "--parent", str(os.getpid())]
    tail += ["--once"] if once else []
    if ranks == 1:
        return [sys.executable, "-m", *tail, "--backend", "serial"]
    launcher = mpiexec()
    if launcher is None:
        raise ToldError(
            f"Rendering with {ranks} ranks needs MPI, and there is no mpiexec; install "
            "the extra 'mpi' or use --ranks 1."
        )
    python = [sys.executable, "-m", "mpi4py", "-m"]
    return [launcher, "-n", str(ranks), *python, *tail, "--backend", "mpi"]


class Worker:
    """Hold a running worker."""

    def __init__(self, child: "subprocess.Popen[bytes]", log: Path) -> None:
        self._child = child
        self._log = log

    @property
    def pid(self) -> int:
        """Get the process id of the worker or its launcher."""
        return self._child.pid

    def ensure_alive(self) -> None:
        """Raise ToldError, with the worker's last words, when it has died."""
        status = self._child.poll()
        if status is None:
            return
        lines = self._log.read_text(errors="replace").strip().splitlines()
        said = f": {lines[-1]}" if lines else ""
        raise ToldError(f"The snapshot worker ended with status {status}{said}")


@contextmanager
def running_worker(spool: Path, *, ranks: int) -> Iterator[Worker]:
    """Run a worker while the context lasts; nothing of it is left afterwards."""
    log = spool / "worker.log"
    with log.open("wb") as sink:
        child = subprocess.Popen(
            worker_command(spool, ranks=ranks, once=False),
            stdin=subprocess.PIPE,
            stdout=sink,
            stderr=sink,
            # Its own group: Ctrl-C reaches the program that holds it, which ends it.
            start_new_session=True,
        )
    try:
        yield Worker(child, log)
    finally:
        _end(child)


def run_worker_command(spool: Path, *, ranks: int, once: bool) -> int:
    """Serve a spool folder in the foreground: `paravol worker`."""
    command = worker_command(spool, ranks=ranks, once=once)
    child = subprocess.Popen(command)
    try:
        return child.wait()
    except KeyboardInterrupt:
        child.terminate()
        child.wait(STOP_S)
        raise


def _end(child: "subprocess.Popen[bytes]") -> None:
    """End a worker and everything in its process group."""
    if child.stdin is not None:
        child.stdin.close()
    for number in (signal.SIGTERM, signal.SIGKILL):
        try:
            os.killpg(child.pid, number)
        except ProcessLookupError:
            break
        try:
            child.wait(STOP_S)
        except subprocess.TimeoutExpired:
            continue
    child.wait()
