"""The snapshot worker as child processes: started, watched, ended."""

import math
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from disk import UserError
from renderers.art.ranks.transport import TransportError
from renderers.snapshots.launcher import find_launcher

STOP_S = 5.0


@dataclass(frozen=True, slots=True)
class WorkerOptions:
    """Set up a worker; see `paravol worker --help`. None: the worker's default."""

    ranks: int = 1
    once: bool = False
    threads: int | None = None
    dataflow: str | None = None
    from_file: bool = False
    cache_cells: int | None = None
    lease_s: float | None = None
    keep_days: float | None = None

    def __post_init__(self) -> None:
        if self.ranks < 1:
            raise UserError(f"--ranks must be at least 1, got {self.ranks}")
        if self.threads is not None and self.threads < 1:
            raise UserError(f"--threads must be at least 1, got {self.threads}")
        if self.cache_cells is not None and self.cache_cells < 1:
            raise UserError(f"--cache-cells must be at least 1, got {self.cache_cells}")
        if self.lease_s is not None and not 0 < self.lease_s < math.inf:
            raise UserError(f"--lease must be a positive time, got {self.lease_s:g}")
        if self.keep_days is not None and not 0 <= self.keep_days < math.inf:
            raise UserError(f"--keep-days must not be negative, got {self.keep_days}")
        if self.ranks == 1 and (self.dataflow or self.cache_cells or self.from_file):
            raise UserError(
                "--dataflow, --cache-cells and --from-file say how ranks share cells; "
                "take more --ranks than 1 with them."
            )

    def words(self) -> list[str]:
        """Return these options as arguments of `python -m renderers.snapshots`."""
        values = {
            "--threads": self.threads,
            "--dataflow": self.dataflow,
            "--cache-cells": self.cache_cells,
            "--lease": self.lease_s,
            "--keep-days": self.keep_days,
        }
        words = ["--once"] if self.once else []
        words += ["--from-file"] if self.from_file else []
        for name, value in values.items():
            words += [] if value is None else [name, str(value)]
        return words


def worker_command(spool: Path, options: WorkerOptions) -> list[str]:
    """Return the command line that serves `spool`.

    Raises UserError when ranks are wanted and there is no MPI to start them.
    """
    ranks = options.ranks
    tail = ["renderers.snapshots", "--spool", str(spool), "--parent", str(os.getpid())]
    tail += options.words()
    if ranks == 1:
        return [sys.executable, "-m", *tail, "--backend", "serial"]
    try:
        launcher = find_launcher()
    except TransportError as error:
        raise UserError(str(error)) from error
    if launcher is None:
        raise UserError(
            f"Rendering with {ranks} ranks needs MPI, and there is no mpiexec; install "
            "the extra 'mpi' or use --ranks 1."
        )
    python = [sys.executable, "-m", "mpi4py", "-m"]
    return [*launcher.command(ranks), *python, *tail, "--backend", "mpi"]


class Worker:
    """Hold a running worker."""

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
            worker_command(spool, WorkerOptions(ranks)),
            stdin=subprocess.PIPE,
            stdout=sink,
            stderr=sink,
            # Its own group: Ctrl-C reaches the program that holds it, which ends it.
            start_new_session=True,
        )
    if niceness:
        os.setpriority(os.PRIO_PGRP, child.pid, niceness)
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
