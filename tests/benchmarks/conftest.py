"""Rows to write, compare and draw."""

import pytest

from benchmarks.machine import Machine
from benchmarks.schema import Row, Times

HERE = Machine(cpu="a", cores=2, memory_gib=8.0, system="Linux", load=0.5)


@pytest.fixture
def row() -> Row:
    return Row(
        suite="art",
        case="phantom/inside/wall",
        mode="ART, step 1",
        baseline="VTK, step 1",
        time_s=Times(min=0.1, median=0.11),
        cpu_s=0.09,
        repeats=5,
        clock="cpu",
        baseline_s=0.18,
        ratio=2.0,
        error_unit="linear",
        rmse=1e-3,
        p999=1e-2,
        max=0.1,
        bias=-1e-5,
        counters={"samples": 12.0},
        settings={"size": 64, "step_voxels": 1.0, "series": "ART", "threads": 1},
        machine=HERE,
        versions={"python": "3.11"},
        commit="abc",
    )
