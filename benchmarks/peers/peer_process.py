"""A peer in a child process, spoken to in lines of JSON.

Constructing a VTK window on a machine without an OpenGL library ends the process by a
signal, which no exception handler sees, and so does Mitsuba's compiler where it cannot
make code. So peers never run in the process that measures us; and their threads,
caches and drivers stay out of our CPU time.
"""

import contextlib
import os
import signal
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import IO, Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from benchmarks.machine import ROOT
from benchmarks.plan import UnavailableError
from benchmarks.timing import Timing
from system import UserError

OPENGL_HINT = (
    "no OpenGL here; on Debian `apt-get install libegl1 libgl1-mesa-dri` brings it "
    "without a screen"
)


class Answer(msgspec.Struct, kw_only=True):
    """A peer's answer: times of one frame, and the file its picture lies in.

    error: one sentence, when it could not.
    """

    error: str | None = None
    timing: Timing = Timing(0.0, 0.0, 0.0, 0)
    picture: str | None = None


class PeerProcess:
    """Run one module of ``benchmarks.peers`` as a child while needed.

    hint: what it probably lacks where a signal ends it, and the remedy.
    """

    def __init__(self, module: str, hint: str = OPENGL_HINT) -> None:
        self._module = module
        self._hint = hint
        self._child: subprocess.Popen[bytes] | None = None
        self._folder: tempfile.TemporaryDirectory[str] | None = None
        self._log: IO[bytes] | None = None
        self._failed: str | None = None
        self._arrays = 0

    def store(self, array: NDArray[Any]) -> str:
        """Write an array where the child can read it; give the file's name."""
        self._start()
        assert self._folder is not None
        self._arrays += 1
        path = Path(self._folder.name) / f"input{self._arrays}.npy"
        np.save(path, array, allow_pickle=False)
        return str(path)

    def ask(self, job: dict[str, Any]) -> Answer:
        """Let the child do a job.

        Raises UnavailableError when the child cannot, or has died; it is not started
        again.
        """
        self._start()
        assert self._child is not None
        assert self._child.stdin is not None
        assert self._child.stdout is not None
        try:
            self._child.stdin.write(msgspec.json.encode(job) + b"\n")
            self._child.stdin.flush()
            line = self._child.stdout.readline()
        except BrokenPipeError:
            line = b""
        if not line:
            self._failed = self._obituary()
            raise UnavailableError(self._failed)
        answer = msgspec.json.decode(line, type=Answer)
        if answer.error is not None:
            raise UnavailableError(answer.error)
        return answer

    def picture(self, answer: Answer) -> NDArray[np.float32]:
        """Read the picture of an answer: linear RGB ``(h, w, 3)``."""
        if answer.picture is None:
            raise UserError("this answer of a peer came without a picture")
        picture: NDArray[np.float32] = np.load(answer.picture, allow_pickle=False)
        return picture

    def close(self) -> None:
        """End the child and remove its files."""
        if self._child is not None:
            for pipe in (self._child.stdin, self._child.stdout):
                # What a dead child has not read cannot be flushed any more.
                with contextlib.suppress(BrokenPipeError):
                    if pipe is not None:
                        pipe.close()
            try:
                self._child.wait(5)
            except subprocess.TimeoutExpired:
                self._child.kill()
                self._child.wait()
            self._child = None
        if self._log is not None:
            self._log.close()
            self._log = None
        if self._folder is not None:
            self._folder.cleanup()
            self._folder = None

    def _start(self) -> None:
        if self._failed is not None:
            raise UnavailableError(self._failed)
        if self._child is not None:
            return
        self._folder = tempfile.TemporaryDirectory(prefix="paravol-peer-")
        # Closed by `close`: it lives as long as the child.
        self._log = open(Path(self._folder.name) / "log", "w+b")  # noqa: SIM115
        environment = {k: v for k, v in os.environ.items() if k != "DISPLAY"}
        environment |= {
            "VTK_DEFAULT_OPENGL_WINDOW": "vtkEGLRenderWindow",
            # One core: software OpenGL's threads come on top of the calling one.
            "LP_NUM_THREADS": "0",
            "VTK_SMP_MAX_THREADS": "1",
        }
        self._child = subprocess.Popen(
            [sys.executable, "-m", self._module, self._folder.name],
            cwd=ROOT,
            env=environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._log,
        )

    def _obituary(self) -> str:
        assert self._child is not None
        status = self._child.wait()
        if status < 0:
            name = signal.Signals(-status).name
            return f"{self._module} was ended by {name}: {self._hint}"
        assert self._log is not None
        self._log.seek(0)
        lines = self._log.read().decode(errors="replace").strip().splitlines()
        said = lines[-1] if lines else f"exit status {status}"
        return f"{self._module} ended early: {said}"
