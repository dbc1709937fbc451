"""Rows to write, compare and draw."""

from collections.abc import Callable

import msgspec
import numpy as np
import pytest

from anatomy import classic_transfer_function
from benchmarks import nasal_views
from benchmarks.machine import Machine
from benchmarks.scenes import Subject, SubjectSource, ViewPoint
from benchmarks.schema import Row, Times
from renderers.scene import AirSurface, Scene, Volume

HERE = Machine(cpu="a", cores=2, memory_gib=8.0, system="Linux", load=0.5)


class Unseen:
    """A reporter of progress that nobody looks at."""

    def __call__(self, stage: str, share: float) -> None:
        pass

    def say(self, text: str) -> None:
        pass


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


def hollow_ball() -> Subject:
    """Give a thick shell of tissue, seen from its cavity and from outside."""
    axis = np.arange(33.0) - 16
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij")
    radius = np.sqrt(x**2 + y**2 + z**2)
    distance = (2.5 - np.abs(radius - 10.5)).astype(np.float32)
    origin, ones = np.full(3, -16.0), np.ones(3)
    hu = np.clip(500 * distance - 500, -1000, 800).astype(np.int16)
    grid = Volume(distance, ones, origin, background=-1.0)
    surface = AirSurface(
        grid,
        grid.with_values(np.full(grid.shape, 54, np.uint8), 0.0),
        grid.with_values(np.zeros(grid.shape, np.uint8), 0.0),
    )
    scene = Scene(
        Volume(hu, ones, origin), classic_transfer_function(), surface=surface
    )
    views = {
        "inside": ViewPoint("inside", np.zeros(3), np.array([0.2, -5.0, 1.0]), 0.7),
        "outside": ViewPoint("outside", np.array([3.0, -60.0, 4.0]), np.zeros(3), 0.3),
    }
    return Subject(scene, views)


@pytest.fixture
def ball() -> SubjectSource:
    return SubjectSource("ball", hollow_ball)


@pytest.fixture
def coarse_nasal_scene(monkeypatch: pytest.MonkeyPatch) -> Callable[[str], Scene]:
    """Heads of the nasal views in voxels of 1 mm, kept nowhere."""
    scenario, path = nasal_views.bundled_flight()
    head = msgspec.structs.replace(scenario.head, spacing_mm=1.0)
    coarse = msgspec.structs.replace(scenario, head=head)
    monkeypatch.setattr(nasal_views, "bundled_flight", lambda: (coarse, path))
    return nasal_views.nasal_scene.__wrapped__
