"""What this machine can do, what is missing, and what brings it: all but OpenGL."""

import os
import platform
import shutil
import subprocess
import sys
from importlib.metadata import packages_distributions
from pathlib import Path

from platformdirs import user_cache_path, user_data_path

from paravol.checks.finding import Finding
from paravol.versions import versions
from renderers.art.ranks.transport import TransportError
from renderers.snapshots.launcher import Launcher, find_launcher
from system import memory_bytes, usable_cores

VECTOR_FLAGS = ("sse4_2", "avx", "avx2", "fma", "avx512f", "neon", "asimd")
LEAST_MEMORY_GB = 3.0
"""The demo's processes together stay below this."""

_VERSION_PATIENCE_S = 20.0
_RANKS_PATIENCE_S = 30.0


def machine_findings() -> list[Finding]:
    """Look at the interpreter, the processor, the memory, packages and caches."""
    return [
        _python(),
        _processor(),
        _memory(),
        *_packages(),
        _package_names(),
        _kernel_cache(),
        _kernels(),
        _phantom_cache(),
    ]


def program_findings() -> list[Finding]:
    """Look for MPI, ffmpeg and room on the disks; starts two ranks, takes a second."""
    return [_mpi(), _ffmpeg(), *_disks()]


def _python() -> Finding:
    is_old = sys.version_info < (3, 11)
    remedy = "Python 3.11 or newer is needed." if is_old else ""
    value = f"{platform.python_version()} in {sys.prefix}"
    return Finding("Python", value, is_old, remedy)


def _processor() -> Finding:
    told = _table_of(Path("/proc/cpuinfo"))
    model = told.get("model name") or platform.processor() or platform.machine()
    words = (told.get("flags") or told.get("Features") or "").split()
    flags = " ".join(flag for flag in VECTOR_FLAGS if flag in words)
    usable = usable_cores()
    return Finding(
        "processor",
        f"{model}, {usable} of {os.cpu_count()} cores usable; {flags or 'no flags'}",
        why="it draws the endoscope's picture, so frames depend on it",
    )


def _memory() -> Finding:
    total = memory_bytes() / 1e9
    told = _table_of(Path("/proc/meminfo")).get("MemAvailable", "")
    free = ""
    if told.endswith(" kB"):
        free = f", {float(told.removesuffix(' kB')) * 1024 / 1e9:.1f} GB available"
    is_small = total < LEAST_MEMORY_GB
    remedy = f"At least {LEAST_MEMORY_GB:g} GB are needed." if is_small else ""
    why = "head, picture and recording lie in it"
    return Finding("memory", f"{total:.1f} GB{free}", is_small, remedy, why)


def _packages() -> list[Finding]:
    found = []
    for name, version in versions().items():
        if name in ("python", "platform", "paravol-ess"):
            continue
        is_absent = version == "not installed"
        is_optional = name == "mpi4py"
        remedy = ""
        if is_absent:
            extra = "'paravol-ess[mpi]'" if is_optional else "paravol-ess"
            remedy = f"pip install {extra} brings it."
        found.append(Finding(name, version, is_absent and not is_optional, remedy))
    return found


OUR_PACKAGES = (
    *("anatomy", "app", "benchmarks", "devices", "system", "paravol"),
    *("renderers", "scenarios", "surgery"),
)
"""Top-level packages of this distribution."""


def _package_names() -> Finding:
    """Look whether other distributions bring packages of the same names.

    Some of our names are plain words. Two distributions that install the same package
    overwrite each other's files.
    """
    others = {
        name: sorted(set(makers) - {"paravol-ess"})
        for name, makers in packages_distributions().items()
        if name in OUR_PACKAGES and set(makers) - {"paravol-ess"}
    }
    why = "two distributions with a package of the same name overwrite each other"
    if not others:
        return Finding("package names", "no other distribution has them", why=why)
    told = "; ".join(f"{name} by {', '.join(by)}" for name, by in others.items())
    told = f"brought by others too: {told}"
    remedy = "Install paravol-ess into an environment of its own."
    return Finding("package names", told, True, remedy, why)


_COMPILED = "made in the first minutes of use; the folder may be removed at any time"


def _kernel_cache() -> Finding:
    from paravol.environment import prepare_environment

    folder = prepare_environment()
    if not folder.exists():
        return Finding("compiled kernels", f"{folder}, not made yet", why=_COMPILED)
    size = f"{_megabytes(folder):.0f} MB"
    return Finding("compiled kernels", f"{folder}, {size}", why=_COMPILED)


def _kernels() -> Finding:
    from renderers.simd.self_check import vector_problem

    problem = vector_problem()
    if problem:
        remedy = f"{problem} The versions in requirements.lock are known to work."
        return Finding("kernels in use", "scalar", remedy=remedy)
    return Finding("kernels in use", "vector, checked against scalars")


def _phantom_cache() -> Finding:
    from anatomy.files.cache import default_folder

    folder = default_folder()
    heads = list(folder.glob("*.npz"))
    return Finding(
        "phantoms",
        f"{folder}, {len(heads)} kept, {_megabytes(folder):.0f} MB",
        why="heads that were built once; the folder may be removed at any time",
    )


def _mpi() -> Finding:
    why = "snapshots are drawn by several ranks with it, by one without"
    try:
        launcher = find_launcher()
    except TransportError as error:
        return Finding("MPI", "not to be used", remedy=str(error), why=why)
    if launcher is None:
        remedy = "Snapshots use one rank; pip install 'paravol-ess[mpi]' brings MPI."
        return Finding("MPI", "no mpiexec", remedy=remedy, why=why)
    version = _first_line([launcher.path, "--version"])
    told, remedy = two_ranks(launcher)
    return Finding("MPI", f"{launcher.path}: {version}; {told}", remedy=remedy, why=why)


_COUNT_RANKS = "from mpi4py import MPI; print(MPI.COMM_WORLD.allreduce(1))"


def two_ranks(launcher: Launcher) -> tuple[str, str]:
    """Start two ranks that count each other; return what came of it and the remedy."""
    command = [*launcher.command(2), sys.executable, "-c", _COUNT_RANKS]
    try:
        done = _run(command, _RANKS_PATIENCE_S)
    except (OSError, subprocess.TimeoutExpired) as error:
        return f"two ranks do not start ({error})", "Use --ranks 1, or mend mpiexec."
    # two ranks print at once, so that their line ends may come later
    counts = "".join(done.stdout.split())
    if done.returncode == 0 and counts == "22":
        return "two ranks found each other", ""
    if counts == "11":
        return (
            "two ranks start and do not find each other",
            "mpiexec and mpi4py belong to different MPIs: pip install "
            "'paravol-ess[mpi]' brings a pair, or build mpi4py against this mpiexec "
            "(pip install --no-binary mpi4py --force-reinstall mpi4py).",
        )
    lines = done.stderr.strip().splitlines()
    said = lines[-1] if lines else f"status {done.returncode}"
    return (
        f"two ranks fail ({said})",
        "Snapshots use one rank; pip install 'paravol-ess[mpi]' brings an MPI.",
    )


def _disks() -> list[Finding]:
    """Say how much room there is for recordings and for what is kept compiled."""
    found = []
    for name, folder, need_gb, why in (
        (
            "room for recordings",
            user_data_path("paravol", appauthor=False),
            2.0,
            "flights are recorded there, up to 1 GB of them",
        ),
        (
            "room for caches",
            user_cache_path("paravol", appauthor=False),
            1.0,
            "kernels and heads are kept there; without them each start takes minutes",
        ),
    ):
        place = folder
        while not place.exists():
            place = place.parent
        free_gb = shutil.disk_usage(place).free / 1e9
        remedy = ""
        if free_gb < need_gb:
            remedy = (
                f"Less than {need_gb:g} GB: make room, or let XDG_DATA_HOME and "
                "XDG_CACHE_HOME name a larger disk."
            )
        if not os.access(place, os.W_OK):
            remedy = f"{place} cannot be written: correct its permissions."
        told = f"{free_gb:.1f} GB free at {folder}"
        found.append(Finding(name, told, remedy=remedy, why=why))
    return found


def _ffmpeg() -> Finding:
    from imageio_ffmpeg import get_ffmpeg_exe

    try:
        program = get_ffmpeg_exe()
    except RuntimeError:
        remedy = "On Debian, apt install ffmpeg brings it."
        return Finding("ffmpeg", "none", is_missing=True, remedy=remedy)
    version = _first_line([program, "-version"])
    return Finding("ffmpeg", version, why="it writes the films")


def _run(command: list[str], patience_s: float) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        command, capture_output=True, text=True, errors="replace", timeout=patience_s
    )


def _first_line(command: list[str]) -> str:
    """Return the first line about a version."""
    try:
        done = _run(command, _VERSION_PATIENCE_S)
    except (OSError, subprocess.TimeoutExpired) as error:
        return f"does not answer ({error})"
    lines = [line.strip() for line in done.stdout.splitlines()]
    told = [line for line in lines if "ersion" in line] or lines or ["says nothing"]
    return " ".join(told[0].split())


def _table_of(path: Path) -> dict[str, str]:
    """Read the first ``name : value`` of each name; empty where there is no file."""
    found: dict[str, str] = {}
    try:
        text = path.read_text(encoding="utf-8", errors="replace")
    except OSError:
        return found
    for line in text.splitlines():
        name, colon, value = line.partition(":")
        if colon:
            found.setdefault(name.strip(), value.strip())
    return found


def _megabytes(folder: Path) -> float:
    return sum(f.stat().st_size for f in folder.rglob("*") if f.is_file()) / 1e6
