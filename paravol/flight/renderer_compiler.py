"""Compile the renderers in a process beside a flight's preparation, the first time.

A compiler holds the interpreter: in a thread beside it would gain nothing. What the
process compiles is in numba's cache when the flight comes to draw.
"""

import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import Self

from paravol.environment import prepare_environment
from system.file_lock import locked

STAGE = "Compiling the renderers, once on this machine"

EXERCISE = "hoops"
"""Its scene is built and drawn in no time, and needs nearly all that a head needs."""

FILES = 226
"""Of numba's cache that drawing that scene fills."""

LOOKED_EVERY_S = 0.1


class RendererCompiler:
    """A process that compiles the renderers; none where that was done.

    Leaving the context ends it. What it has compiled until then stays.
    """

    def __init__(self) -> None:
        """Begin."""
        self._folder = Path(os.environ["NUMBA_CACHE_DIR"])
        self._child: subprocess.Popen[bytes] | None = None
        if not _mark(self._folder).exists():
            # it ends with this process, however that ends: then the pipe is closed
            self._child = subprocess.Popen(
                [sys.executable, "-m", __name__],
                stdin=subprocess.PIPE,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
            )

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._child is not None:
            self._child.terminate()
            self._child.communicate()

    def wait(self, progress: Callable[[str, float], None]) -> None:
        """Wait for its end; what `progress` raises ends the waiting.

        One that fails is no error here: whoever draws compiles what is missing.
        """
        while self._child is not None and self._child.poll() is None:
            found = sum(1 for _ in self._folder.glob("kernels_*/*.nbc"))
            progress(STAGE, min(found / FILES, 0.99))
            time.sleep(LOOKED_EVERY_S)


def _mark(folder: Path) -> Path:
    """Return the file that says that the renderers are compiled."""
    return folder / "renderers-are-compiled"


def _end_with_parent() -> None:
    sys.stdin.read()
    os._exit(1)


def _compile(folder: Path) -> None:
    from paravol.exercises.exercise_path import start_path
    from paravol.flight.picture_size import FIRST_PX
    from paravol.patient import load_patient
    from paravol.sessions.session_setup import build_view, first_views, operate_on
    from scenarios import load_scenario

    def told(stage: str, share: float) -> None:
        """Tell nobody."""

    scenario, _ = load_scenario(EXERCISE)
    patient, _ = operate_on(load_patient(scenario, told))
    view = build_view(scenario, patient, threads=1)
    path = start_path(patient, scenario.start)
    view.warm_up(first_views(scenario, patient, path, (FIRST_PX, FIRST_PX)), told)
    _mark(folder).touch()


if __name__ == "__main__":
    threading.Thread(target=_end_with_parent, daemon=True).start()
    kernels = prepare_environment()
    # of several that begin at once the first compiles
    with locked(_mark(kernels).with_suffix(".lock"), creates=True):
        if not _mark(kernels).exists():
            _compile(kernels)
