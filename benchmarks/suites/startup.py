"""How long it takes to begin: commands, imports, the first frame, a worker."""

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from importlib.util import find_spec

from benchmarks.machine import ROOT
from benchmarks.plan import Measured, Plan, Task, UnavailableError
from benchmarks.timing import Timing
from renderers.snapshots.launcher import find_launcher

ALONE = "python alone"
CACHED = "kernels cached"
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


@dataclass(frozen=True, slots=True)
class Run:
    """Hold one life of a child, seconds."""

    wall_s: float
    cpu_s: float


def run_child(arguments: list[str], environment: dict[str, str] | None = None) -> Run:
    """Run a program to its end; CPU time includes its own children.

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
    return Run(wall, used.ru_utime + used.ru_stime)


class StartupPlan(Plan, suite="startup"):
    """List and make the measurements of suite `startup`."""

    def __init__(self, quick: bool) -> None:
        super().__init__(quick)
        self._repeats = 2 if quick else 10

    def tasks(self) -> list[Task]:
        """List the tasks, the long ones last."""
        python = sys.executable
        found = [self._task("command", ALONE, [python, "-c", "pass"])]
        found += [
            self._task(
                "command", f"paravol {words}", [python, "-m", "app", *words.split()],
                baseline=ALONE,
            )
            for words in COMMANDS
        ]  # fmt: skip
        found.append(self._task("import", ALONE, [python, "-c", "pass"]))
        found += [
            self._task("import", name, [python, "-c", f"import {name}"], baseline=ALONE)
            for name in MODULES
            if find_spec(name.partition(".")[0]) is not None
        ]
        found += [self._worker(ranks) for ranks in (1, 2)]
        frame = [python, "-m", "benchmarks.suites.first_frame"]
        found.append(self._task("first frame", CACHED, frame, cost_s=20.0))
        found.append(
            self.task(
                "first frame",
                "kernels compiled",
                lambda: self._compiled(frame),
                {"repeats": 1},
                baseline=CACHED,
                clock="wall",
                cost_s=70.0,
            )
        )
        return found

    def _measured(
        self, run: Callable[[], Run], repeats: int, *, warm_up: bool
    ) -> Measured:
        if warm_up:
            run()
        runs = [run() for _ in range(repeats)]
        return Measured(
            Timing.of([run.wall_s for run in runs], [run.cpu_s for run in runs])
        )

    def _task(
        self,
        case: str,
        mode: str,
        arguments: list[str],
        *,
        baseline: str | None = None,
        cost_s: float = 5.0,
    ) -> Task:
        return self.task(
            case,
            mode,
            lambda: self._measured(
                lambda: run_child(arguments), self._repeats, warm_up=True
            ),
            {"repeats": self._repeats},
            baseline=baseline,
            clock="wall",
            cost_s=cost_s,
        )

    def _compiled(self, frame: list[str]) -> Measured:
        with tempfile.TemporaryDirectory(prefix="paravol-cold-") as folder:
            return self._measured(
                lambda: run_child(frame, {"NUMBA_CACHE_DIR": folder}), 1, warm_up=False
            )

    def _worker(self, ranks: int) -> Task:
        """Start a snapshot worker on an empty spool, which it leaves at once."""

        def start() -> Measured:
            if ranks > 1 and find_launcher() is None:
                raise UnavailableError("there is no mpiexec; the extra 'mpi' brings it")
            with tempfile.TemporaryDirectory(prefix="paravol-spool-") as spool:
                words = ["worker", "--spool", spool, "--ranks", str(ranks), "--once"]
                words += ["--oversubscribe"]
                arguments = [sys.executable, "-m", "app", *words]
                return self._measured(
                    lambda: run_child(arguments), self._repeats, warm_up=True
                )

        return self.task(
            "worker",
            "1 rank" if ranks == 1 else f"{ranks} ranks",
            start,
            {"repeats": self._repeats, "ranks": ranks},
            baseline=None if ranks == 1 else "1 rank",
            clock="wall",
            cost_s=10.0,
        )
