"""What the machine says of itself, checked against where else it says so."""

import os
from pathlib import Path

import pytest

from system import memory_bytes, usable_cores


def test_memory_is_what_the_kernel_says() -> None:
    told = Path("/proc/meminfo")
    if not told.is_file():
        pytest.skip("no /proc/meminfo here")
    lines = told.read_text().splitlines()
    total = next(line for line in lines if line.startswith("MemTotal:"))
    assert memory_bytes() == pytest.approx(1024 * int(total.split()[1]), rel=1e-3)


def test_only_processors_that_this_process_may_use_count(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert 1 <= usable_cores() <= (os.cpu_count() or 1)
    monkeypatch.setattr("os.sched_getaffinity", lambda process: {3, 5}, raising=False)
    assert usable_cores() == 2
    monkeypatch.delattr("os.sched_getaffinity")
    assert usable_cores() == os.cpu_count()
