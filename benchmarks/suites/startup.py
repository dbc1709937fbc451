"""How long it takes to begin: commands, imports, the first frame, a worker."""

import os
import subprocess
import sys
import tempfile
import time
from functools import partial
from importlib.util import find_spec

from benchmarks.machine import ROOT
from benchmarks.plan import Measured, Plan, Task, UnavailableError
from benchmarks.schema import Setting
from benchmarks.timing import Timing
from renderers.snapshots.launcher import find_launcher

ALONE = "python alone"
CACHED, COMPILED = "kernels cached", "kernels compiled"
COMMANDS = ("--help", "demo --help")
MODULES = (
    "numpy",
    "numba",
    "scipy.ndimage",
    "anatomy",
    "renderers.fsr",
    "renderers.art",
    "renderers.shading",
    "vtk",
    "pyvista",
)


def run_child(
    arguments: list[str], environment: dict[str, str] | None = None
) -> tuple[float, float]:
    """Run a program to its end; get wall and CPU seconds, its children's included.

    Raises UnavailableError with its last words when it fails.
    """
    with tempfile.TemporaryFile() as said:
        began = time.perf_counter()
        child = subprocess.Popen(
            arguments,
            cwd=ROOT,
            env=os.environ | (environment or {}),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=said,
        )
        _, status, used = os.wait4(child.pid, 0)
        wall = time.perf_counter() - began
        child.returncode = os.waitstatus_to_exitcode(status)
        if child.returncode != 0:
            said.seek(0)
            lines = said.read().decode(errors="replace").strip().splitlines()
            last = lines[-1] if lines else "without a word"
            raise UnavailableError(
                f"{' '.join(arguments[1:])} ended with {child.returncode}: {last}"
            )
    return wall, used.ru_utime + used.ru_stime


class StartupPlan(Plan, suite="startup"):
    """List and make the measurements of suite `startup`."""

    def __init__(self, quick: bool) -> None:
        super().__init__(quick)
        self._repeats = 2 if quick else 10

    def tasks(self) -> list[Task]:
        """List the tasks, the long ones last."""
        python = sys.executable
        alone = {ALONE: [python, "-c", "pass"]}
        commands = {f"paravol {w}": [python, "-m", "app", *w.split()] for w in COMMANDS}
        modules = {
            name: [python, "-c", f"import {name}"]
            for name in MODULES
            if find_spec(name.partition(".")[0]) is not None
        }
        frame = [python, "-m", "benchmarks.suites.first_frame"]
        repeats: dict[str, Setting] = {"repeats": self._repeats}
        found = []
        for case, programs in ("command", commands), ("import", modules):
            runs = {
                mode: partial(self._lives, words)
                for mode, words in (alone | programs).items()
            }
            found += self.compared(case, runs, repeats, clock="wall", cost_s=5.0)
        found += [self._worker(ranks) for ranks in (1, 2)]
        task, case = partial(self.task, clock="wall"), "first frame"
        cached, compiled = partial(self._lives, frame), partial(self._compiled, frame)
        return [
            *found,
            task(case, CACHED, cached, repeats, cost_s=20.0),
            task(case, COMPILED, compiled, {"repeats": 1}, CACHED, cost_s=70.0),
        ]

    def _lives(self, words: list[str]) -> Measured:
        """Time a program from its birth to its death; the first fills caches."""
        run_child(words)
        walls, cpus = zip(
            *(run_child(words) for _ in range(self._repeats)), strict=True
        )
        return Measured(Timing.of(list(walls), list(cpus)))

    @staticmethod
    def _compiled(frame: list[str]) -> Measured:
        with tempfile.TemporaryDirectory(prefix="paravol-cold-") as folder:
            wall, cpu = run_child(frame, {"NUMBA_CACHE_DIR": folder})
        return Measured(Timing(wall, wall, cpu, 1))

    def _worker(self, ranks: int) -> Task:
        """Start a snapshot worker on an empty spool, which it leaves at once."""

        def start() -> Measured:
            if ranks > 1 and find_launcher() is None:
                raise UnavailableError("there is no mpiexec; the extra 'mpi' brings it")
            with tempfile.TemporaryDirectory(prefix="paravol-spool-") as spool:
                words = ["worker", "--spool", spool, "--ranks", str(ranks), "--once"]
                words += ["--oversubscribe"]
                return self._lives([sys.executable, "-m", "app", *words])

        return self.task(
            "worker",
            "1 rank" if ranks == 1 else f"{ranks} ranks",
            start,
            {"repeats": self._repeats, "ranks": ranks},
            baseline=None if ranks == 1 else "1 rank",
            clock="wall",
            cost_s=10.0,
        )
