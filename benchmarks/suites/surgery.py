"""What a change of the tissue costs: derived objects followed locally or made anew."""

import time
from collections.abc import Callable
from functools import cached_property, partial
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from benchmarks.plan import Measured, Plan, Task
from benchmarks.scenes import SubjectSource, subjects
from benchmarks.schema import Setting
from benchmarks.timing import Timing, measure
from renderers.fsr.surfels import SurfelRasterizer
from renderers.scene import Camera, ImageError
from renderers.scene.thread_team import ThreadTeam
from surgery import solids
from surgery.edit import Taker
from surgery.patient import OperatedPatient
from surgery.pushing import Pushing, Rod

REBUILD = "full rebuild"
UPDATE = "local update"
DENT = "dent"
RADIUS_MM = 2.0
ROD_MM = 1.2
PLACES, QUICK_PLACES = 24, 3
SIZE = 128
SAMPLES = 10
"""Of a tool that comes 1 mm deep into a wall."""

Result = TypeVar("Result")


class SurgeryPlan(Plan, suite="surgery"):
    """List and make the measurements of suite `surgery`."""

    def __init__(self, quick: bool) -> None:
        self._source: SubjectSource = subjects(quick)[0]
        self._count = QUICK_PLACES if quick else PLACES
        self._budget_s = 0.3 if quick else 5.0
        self._team = ThreadTeam(1)

    def tasks(self) -> list[Task]:
        """List the tasks, baselines first."""
        settings: dict[str, Setting] = {
            "radius_mm": RADIUS_MM,
            "places": self._count,
            "threads": 1,
        }
        bites = [
            self.task(
                f"{self._source.name}/bite/surfels",
                mode,
                work,
                settings | {"series": mode, "reference": REBUILD},
                baseline=None if mode == REBUILD else REBUILD,
                cost_s=20.0,
            )
            for mode, work in ((REBUILD, self._rebuild), (UPDATE, self._update))
        ]
        pushed = self.task(
            f"{self._source.name}/tool/shown",
            DENT,
            self._dent,
            {"radius_mm": ROD_MM, "places": self._count, "threads": 1, "series": DENT},
            cost_s=20.0,
        )
        return [*bites, pushed]

    def close(self) -> None:
        """End the threads."""
        self._team.close()

    @cached_property
    def _patient(self) -> OperatedPatient:
        surface = self._source.subject.scene.surface
        assert surface is not None
        return OperatedPatient(surface, None)

    @cached_property
    def _places(self) -> NDArray[np.float64]:
        """Return places on walls with 3 mm of air before them, ``(n, 2, 3)``.

        With each the unit direction towards the air.
        """
        distance = self._patient.pristine.distance
        rng = np.random.default_rng(22)
        near = np.argwhere(np.abs(distance.values) < 0.25)[:, ::-1]
        found: list[NDArray[np.float64]] = []
        matrix = distance.world_from_voxel
        step = 0.5 * float(distance.spacing_mm.min())
        for at in near[rng.permutation(len(near))]:
            place = matrix[:3, :3] @ at + matrix[:3, 3]
            around = place + step * np.concatenate([np.eye(3), -np.eye(3)])
            values = distance.sample(around)
            out = values[3:] - values[:3]
            length = float(np.linalg.norm(out))
            if length == 0:
                continue
            out /= length
            if distance.sample(place + 3 * out) < -2.0:
                found.append(np.stack([place, out]))
            if len(found) == self._count:
                break
        return np.array(found)

    def _rebuild(self) -> Measured:
        surface = self._patient.surface
        timing, _ = measure(
            lambda: SurfelRasterizer(surface.distance), budget_s=self._budget_s, most=5
        )
        return Measured(timing, counters={"edit_ms": timing.cpu_s * 1e3})

    def _update(self) -> Measured:
        """Time a bite at a time; the error counts pixels that are not a rebuild's."""
        patient = self._patient
        drawer = SurfelRasterizer(patient.surface.distance)
        clock = _Clock()
        for place, _ in self._places:
            edit = patient.carve(solids.capsule(place, place, RADIUS_MM), Taker())
            if edit is not None:
                clock.time(partial(drawer.update, edit.change))
        fresh = SurfelRasterizer(patient.surface.distance)
        other = 0.0
        for place, out in self._places:
            camera = Camera.looking_at(place + 3 * out, place, size=(SIZE, SIZE))
            a, b = drawer.draw(camera, self._team), fresh.draw(camera, self._team)
            same = (a.depth_mm == b.depth_mm) & np.all(a.normal == b.normal, axis=-1)
            other += float(np.mean(~same)) / len(self._places)
        while (change := patient.undo()) is not None:
            drawer.update(change)
        return Measured(
            clock.timing(),
            ImageError(rmse=other, p999=0.0, max=float(other > 0), bias=other),
            "share of pixels",
            clock.counters("edit"),
        )

    def _dent(self) -> Measured:
        """Time a sample at a time: tissue bent, then its surfels followed."""
        pushing = Pushing(self._patient)
        drawer = SurfelRasterizer(pushing.surface.distance)
        bend, follow = _Clock(), _Clock()
        generation = 0
        for place, out in self._places:
            for depth in np.linspace(0.0, 1.0, SAMPLES):
                rod = Rod.of(place + (ROD_MM - depth) * out, out, ROD_MM)
                generation += 1
                sample = partial(pushing.push, generation / 60, generation, rod)
                change = bend.time(sample)
                if change is not None:
                    follow.time(partial(drawer.update, change))
            if (change := pushing.release(generation)) is not None:
                drawer.update(change)
        return Measured(
            follow.timing(),
            counters=bend.counters("bend") | follow.counters("surfels"),
        )


class _Clock:
    """Time calls; the first, which compiles or finds nothing prepared, is left out."""

    def __init__(self) -> None:
        self._walls: list[float] = []
        self._cpus: list[float] = []

    def time(self, call: Callable[[], Result]) -> Result:
        """Call and keep what it took."""
        cpu, wall = time.process_time(), time.perf_counter()
        result = call()
        self._walls.append(time.perf_counter() - wall)
        self._cpus.append(time.process_time() - cpu)
        return result

    def timing(self) -> Timing:
        """Return the times of the calls."""
        return Timing.of(self._walls[1:], self._cpus[1:])

    def counters(self, what: str) -> dict[str, float]:
        """Return milliseconds of CPU time of a median call and of one in twenty."""
        ms = np.array(self._cpus[1:]) * 1e3
        return {
            f"{what}_ms": float(np.median(ms)),
            f"{what}_ms_95_percent": float(np.percentile(ms, 95)),
            f"{what}_calls": len(ms),
        }
