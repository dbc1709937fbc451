"""What this machine can do, what is missing, and what brings it: all but OpenGL."""

import os
import platform
import subprocess
import sys
from pathlib import Path

from devices.haptics.force_dimension import SDK_FOLDER, library_file
from devices.serial_adapters import (
    LEAST_LATENCY_MS,
    SerialAdapter,
    latency_remedy,
    permission_remedy,
    serial_adapters,
)
from machine import memory_bytes, usable_cores
from paravol.finding import Finding
from paravol.versions import versions
from renderers.art.ranks.transport import TransportError
from renderers.snapshots.launcher import find_launcher

VECTOR_FLAGS = ("sse4_2", "avx", "avx2", "fma", "avx512f", "neon", "asimd")
LEAST_MEMORY_GB = 3.0
"""The demo's processes together stay below this."""

_VERSION_PATIENCE_S = 20.0


def machine_findings() -> list[Finding]:
    """Look at the interpreter, the processor, the memory, packages and caches."""
    return [
        _python(),
        _processor(),
        _memory(),
        *_packages(),
        _kernel_cache(),
        _kernels(),
        _phantom_cache(),
    ]


def program_findings() -> list[Finding]:
    """Look for MPI, ffmpeg, the ports an arm may be at, and what pushes back."""
    return [_mpi(), _ffmpeg(), serial_ports(), force_devices()]


def _python() -> Finding:
    is_old = sys.version_info < (3, 11)
    return Finding(
        "Python",
        f"{platform.python_version()} in {sys.prefix}",
        is_old,
        "Python 3.11 or newer is needed." if is_old else "",
    )


def _processor() -> Finding:
    told = _table_of(Path("/proc/cpuinfo"))
    model = told.get("model name") or platform.processor() or platform.machine()
    words = (told.get("flags") or told.get("Features") or "").split()
    flags = " ".join(flag for flag in VECTOR_FLAGS if flag in words)
    usable = usable_cores()
    return Finding(
        "processor",
        f"{model}, {usable} of {os.cpu_count()} cores usable; {flags or 'no flags'}",
    )


def _memory() -> Finding:
    total = memory_bytes() / 1e9
    told = _table_of(Path("/proc/meminfo")).get("MemAvailable", "")
    free = ""
    if told.endswith(" kB"):
        free = f", {float(told.removesuffix(' kB')) * 1024 / 1e9:.1f} GB available"
    is_small = total < LEAST_MEMORY_GB
    return Finding(
        "memory",
        f"{total:.1f} GB{free}",
        is_small,
        f"At least {LEAST_MEMORY_GB:g} GB are needed." if is_small else "",
    )


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


def _kernel_cache() -> Finding:
    from paravol.environment import prepare_environment

    folder = prepare_environment()
    if not folder.exists():
        return Finding("compiled kernels", f"{folder}, not made yet")
    return Finding("compiled kernels", f"{folder}, {_megabytes(folder):.0f} MB")


def _kernels() -> Finding:
    from renderers.lanes.self_check import vector_problem

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
        "phantoms", f"{folder}, {len(heads)} kept, {_megabytes(folder):.0f} MB"
    )


def _mpi() -> Finding:
    try:
        launcher = find_launcher()
    except TransportError as error:
        return Finding("MPI", "not to be used", remedy=str(error))
    if launcher is None:
        return Finding(
            "MPI",
            "no mpiexec",
            remedy="Snapshots use one rank; pip install 'paravol-ess[mpi]' brings MPI.",
        )
    return Finding(
        "MPI", f"{launcher.path}: {_first_line([launcher.path, '--version'])}"
    )


def _ffmpeg() -> Finding:
    from imageio_ffmpeg import get_ffmpeg_exe

    try:
        program = get_ffmpeg_exe()
    except RuntimeError:
        return Finding(
            "ffmpeg",
            "none",
            is_missing=True,
            remedy="On Debian, apt install ffmpeg brings it.",
        )
    return Finding("ffmpeg", _first_line([program, "-version"]))


def serial_ports(adapters: list[SerialAdapter] | None = None) -> Finding:
    """Report the ports an arm may be at, and what hinders it there."""
    if adapters is None:
        from devices.microscribe.driver.driver import SerialPorts

        adapters = serial_adapters(SerialPorts().names())
    told, remedies = [], []
    for adapter in adapters:
        names = f"{adapter.by_id} ({adapter.name})" if adapter.by_id else adapter.name
        timer = adapter.latency_ms
        told.append(names + (f", latency timer {timer} ms" if timer else ""))
        if not adapter.is_allowed:
            told[-1] += ", not yours to open"
            remedies.append(f"{adapter.name}: {permission_remedy(adapter.name)}.")
        elif timer is not None and timer > LEAST_LATENCY_MS:
            remedies.append(latency_remedy(adapter.name))
    none = "none; a MicroScribe needs one, or a USB adapter"
    return Finding("serial ports", "\n".join(told) or none, remedy="\n".join(remedies))


def _first_line(command: list[str]) -> str:
    """Return the first line about a version."""
    try:
        done = subprocess.run(
            command,
            capture_output=True,
            text=True,
            errors="replace",
            timeout=_VERSION_PATIENCE_S,
        )
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


def force_devices() -> Finding:
    """Say whether the library of real force devices is there; the emulated one is."""
    file = library_file()
    if file is None:
        return Finding(
            "force devices",
            "emulated",
            remedy="For one of Force Dimension's install the maker's SDK and set "
            f"{SDK_FOLDER} to its folder.",
        )
    return Finding("force devices", f"emulated; Force Dimension by {file}")
