"""The program that starts ranks, and the options it needs.

MPICH starts any number of processes as any user and leaves them all processors. Open
MPI needs options: it refuses the superuser and more ranks than cores, and binds one
or two ranks to a core each, on which rank 0 would then shade with all of its threads.
"""

import os
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from renderers.art.ranks.transport import TransportError
from system import user_number

VARIABLE = "PARAVOL_MPIEXEC"
"""Of the environment: the launcher to take."""

_LIBRARY = "MPI4PY_LIBMPI"
"""Tells mpi4py, as its wheel comes, which library to load."""

_OPEN_MPI = ("Open MPI", "OpenRTE", "PRRTE", "prterun")
"""One of these is in what `--version` says, by release."""

_SIZES = ("PMI_SIZE", "OMPI_COMM_WORLD_SIZE", "PMIX_SIZE", "SLURM_STEP_NUM_TASKS")
"""What launchers tell each process, those that know best first."""

_WAIT_S = 30.0


@dataclass(frozen=True, slots=True)
class Launcher:
    """The launcher's path, and whose it is."""

    path: str
    is_open_mpi: bool

    def command(self, ranks: int, *options: str) -> list[str]:
        """Return the arguments that start so many ranks of a program added to them.

        options: of the launcher itself.
        """
        return [self.path, *self._options(), *options, "-n", str(ranks)]

    def _options(self) -> list[str]:
        if not self.is_open_mpi:
            return []
        words = ["--map-by", ":OVERSUBSCRIBE", "--bind-to", "none"]
        if user_number() == 0:
            # Who runs us as the superuser has decided that already.
            words.append("--allow-run-as-root")
        if _LIBRARY in os.environ:
            return [*words, "-x", _LIBRARY]
        # mpi4py would take MPICH's where the extra `mpi` is installed.
        return [*words, "-x", f"{_LIBRARY}=libmpi.so.40"]


def find_launcher() -> Launcher | None:
    """Find the MPI launcher; None where there is none.

    The one that the environment names, else the one beside this Python, else the first
    on the path. Raise TransportError when the one that is named cannot be run.
    """
    named = os.environ.get(VARIABLE)
    if named:
        path = shutil.which(named)
        if path is None:
            raise TransportError(
                f"{VARIABLE} names {named}, which is no program; correct it, or unset "
                "it to take the launcher of the extra `mpi`."
            )
        return launcher_at(path)
    beside = Path(sys.executable).with_name("mpiexec")
    path = str(beside) if beside.exists() else shutil.which("mpiexec")
    return None if path is None else launcher_at(path)


def launched_ranks() -> int:
    """Return how many ranks were started with this one; 1 without a launcher."""
    sizes = (os.environ.get(name, "") for name in _SIZES)
    return next((int(size) for size in sizes if size.isdecimal()), 1)


def expect_company(ranks: int) -> None:
    """Raise TransportError when MPI sees this process alone and its launcher does not.

    Each of them would else be a worker of its own, without a word.
    """
    launched = launched_ranks()
    if ranks == 1 < launched:
        raise TransportError(
            f"This process is one of {launched}, but MPI sees only itself: launcher "
            "and MPI library do not belong together. Under Slurm name the plug-in of "
            "your MPI (srun --mpi=pmi2 for MPICH, pmix for Open MPI); else see "
            f"{VARIABLE} in docs/ranks.md."
        )


def launcher_at(path: str) -> Launcher:
    """Ask a launcher whose it is; raise TransportError when it cannot be run."""
    try:
        said = subprocess.run(
            [path, "--version"],
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            errors="replace",
            timeout=_WAIT_S,
            check=False,
        ).stdout
    except (OSError, subprocess.TimeoutExpired) as error:
        raise TransportError(f"{path} cannot be run: {error}.") from error
    return Launcher(path, any(word in said for word in _OPEN_MPI))
