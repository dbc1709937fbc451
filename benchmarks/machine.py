"""Which machine measured, how busy it was, and which sources it ran."""

import hashlib
import os
import platform
import subprocess
from functools import cache
from pathlib import Path

import msgspec

ROOT = Path(__file__).parents[1]


class Machine(msgspec.Struct, frozen=True, kw_only=True):
    """Describe a machine at one moment.

    cores: those this process may use. load: processes that wanted a core, mean of
    the last minute.
    """

    cpu: str
    cores: int
    memory_gib: float
    system: str
    load: float


def machine() -> Machine:
    """Describe this machine now."""
    return Machine(
        cpu=_cpu(),
        cores=len(os.sched_getaffinity(0)),
        memory_gib=round(
            os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30, 1
        ),
        system=platform.platform(terse=True),
        load=round(os.getloadavg()[0], 2),
    )


def is_same_machine(a: Machine, b: Machine) -> bool:
    """Return whether times of the two may be compared; the load may differ."""
    return (a.cpu, a.cores) == (b.cpu, b.cores)


@cache
def commit(root: Path = ROOT) -> str:
    """Name the sources: the commit, with a hash of them when they differ from it.

    Outside a checkout only the hash: ``sources-...``.
    """
    known = _git(root, "rev-parse", "--short=12", "HEAD")
    if known is None:
        return f"sources-{_sources_hash(root)}"
    changed = _git(root, "status", "--porcelain", "--", *_measured(root))
    return f"{known}+{_sources_hash(root)}" if changed else known


def _measured(root: Path) -> list[str]:
    """List the folders whose contents decide what is measured."""
    names = ("anatomy", "app", "benchmarks", "renderers", "scenarios")
    return [name for name in names if (root / name).is_dir()]


def _sources_hash(root: Path) -> str:
    digest = hashlib.sha256()
    for name in _measured(root):
        for path in sorted((root / name).rglob("*.py")):
            digest.update(f"{path.relative_to(root)}\0".encode() + path.read_bytes())
    return digest.hexdigest()[:8]


def _git(root: Path, *words: str) -> str | None:
    try:
        done = subprocess.run(
            ["git", "-C", str(root), *words],
            capture_output=True,
            text=True,
            timeout=20,
            check=True,
        )
    except (OSError, subprocess.SubprocessError):
        return None
    return done.stdout.strip()


@cache
def _cpu() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(errors="replace").splitlines()
    except OSError:
        lines = []
    for line in lines:
        if line.startswith("model name"):
            return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()
