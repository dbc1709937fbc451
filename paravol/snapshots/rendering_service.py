"""The snapshot worker as child processes: started, watched, ended."""

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from paravol.snapshots.worker_options import WorkerOptions
from renderers.art.ranks.transport import TransportError
from renderers.snapshots.launcher import Launcher, find_launcher
from system import UserError, end_group, group_options, lower_priority

STOP_S = 5.0


def worker_command(spool: Path, options: WorkerOptions) -> list[str]:
    """Return the command line that serves `spool`.

    Raises UserError when ranks are wanted and there is no MPI to start them.
    """
    options.check()
    tail = ["renderers.snapshots", "--spool", str(spool), "--parent", str(os.getpid())]
    tail += options.arguments()
    if options.ranks == 1:
        return [sys.executable, "-m", *tail, "--backend", "serial"]
    python = [sys.executable, "-m", "mpi4py", "-m"]
    start = _launcher(options.ranks).command(options.ranks)
    return [*start, *python, *tail, "--backend", "mpi"]


def startable_ranks(asked: int | None) -> int:
    """Return how many ranks to render with: as asked, else one.

    Its threads are quicker than ranks on the same machine: 1.1 to 1.3 times on two
    cores.

    UserError where more than one is asked for and there is no MPI: before the long
    work that comes first, not after it.
    """
    if asked is None:
        return 1
    if asked > 1:
        _launcher(asked)
    return asked


def _launcher(ranks: int) -> Launcher:
    found = _found_launcher()
    if found is None:
        raise UserError(
            f"Rendering with {ranks} ranks needs MPI, and there is no mpiexec; install "
            "the extra 'mpi' or use --ranks 1."
        )
    return found


def _found_launcher() -> Launcher | None:
    try:
        return find_launcher()
    except TransportError as error:
        raise UserError(str(error)) from error


class Worker:
    """A running worker."""

    def __init__(self, child: "subprocess.Popen[bytes]", log: Path) -> None:
        self._child = child
        self._log = log

    @property
    def pid(self) -> int:
        """Return the process id of the worker or its launcher."""
        return self._child.pid

    def ensure_alive(self) -> None:
        """Raise UserError, with the worker's last words, when it has died."""
        status = self._child.poll()
        if status is None:
            return
        lines = self._log.read_text(errors="replace").strip().splitlines()
        said = f": {lines[-1]}" if lines else ""
        raise UserError(f"The snapshot worker ended with status {status}{said}")


@contextmanager
def running_worker(spool: Path, *, ranks: int, niceness: int = 0) -> Iterator[Worker]:
    """Run a worker while the context lasts; nothing of it is left afterwards.

    niceness: 19 leaves the processor to whoever else wants it.
    """
    log = spool / "worker.log"
    with log.open("wb") as sink:
        child = subprocess.Popen(
            worker_command(spool, WorkerOptions(ranks=ranks)),
            stdin=subprocess.PIPE,
            stdout=sink,
            stderr=sink,
            # Its own group: Ctrl-C reaches the program that holds it, which ends it.
            **group_options(),
        )
    if niceness:
        lower_priority(child, niceness)
    try:
        yield Worker(child, log)
    finally:
        _end(child)


def run_worker_command(spool: Path, options: WorkerOptions) -> int:
    """Serve a spool folder in the foreground: `paravol worker`."""
    child = subprocess.Popen(worker_command(spool, options))
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
    end_group(child, STOP_S)
