"""What one volume may take is a share of what there is."""

from pathlib import Path

import pytest

from renderers.scene.memory_limit import MEMORY_SHARE, machine_memory, memory_limit


def test_the_limit_is_a_share_of_the_machine() -> None:
    assert 0 < memory_limit() <= MEMORY_SHARE * machine_memory()


def test_the_machine_says_the_same_elsewhere() -> None:
    told = Path("/proc/meminfo")
    if not told.is_file():
        pytest.skip("no /proc/meminfo here")
    lines = told.read_text().splitlines()
    total = next(line for line in lines if line.startswith("MemTotal:"))
    assert machine_memory() == pytest.approx(1024 * int(total.split()[1]), rel=1e-3)
