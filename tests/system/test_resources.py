"""What the machine says of itself, checked against where else it says so."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from system import memory_bytes, resources, usable_cores

linux_only = pytest.mark.skipif(
    not Path("/proc/meminfo").is_file(), reason="no /proc/meminfo here"
)


@linux_only
def test_memory_is_what_the_kernel_says(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(resources, "GROUPS", tmp_path)
    lines = Path("/proc/meminfo").read_text().splitlines()
    total = next(line for line in lines if line.startswith("MemTotal:"))
    assert memory_bytes() == pytest.approx(1024 * int(total.split()[1]), rel=1e-3)


@linux_only
def test_a_job_on_a_cluster_has_what_its_group_is_given(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Of either kind of control groups, and of groups around it."""
    found = []
    for name, new, old in (
        ("free", "max", f"{2**63 - 4096}"),
        ("limited", "400000000", "400000000"),
    ):
        groups = tmp_path / name
        (groups / "memory").mkdir(parents=True)
        (groups / "memory.max").write_text(f"{new}\n")
        (groups / "memory" / "memory.limit_in_bytes").write_text(f"{old}\n")
        monkeypatch.setattr(resources, "GROUPS", groups)
        found.append(memory_bytes())
    assert found[1] == 400_000_000 < found[0]


@linux_only
def test_a_process_has_what_it_is_limited_to() -> None:
    """What it takes already is not there to be used."""
    code = (
        "import mmap, resource; resource.setrlimit(resource.RLIMIT_AS, (2 << 30, -1));"
        "from system import memory_bytes; print(memory_bytes());"
        "taken = mmap.mmap(-1, 1 << 30); print(memory_bytes())"
    )
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, check=True)
    before, after = map(int, said.stdout.split())
    assert 1 << 30 < before < 2 << 30
    assert before - after == pytest.approx(1 << 30, rel=0.01)


def test_only_processors_that_this_process_may_use_count(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert 1 <= usable_cores() <= (os.cpu_count() or 1)
    monkeypatch.setattr("os.sched_getaffinity", lambda process: {3, 5}, raising=False)
    assert usable_cores() == 2
    monkeypatch.delattr("os.sched_getaffinity")
    assert usable_cores() == os.cpu_count()
