"""What a change of the tissue costs: derived objects followed locally or made anew."""

from collections.abc import Iterator
from dataclasses import replace
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from anatomy import sinus_phantom
from benchmarks.losslessness import share_error
from benchmarks.nasal_views import bundled_flight
from benchmarks.plan import Measured, Plan, Task
from benchmarks.scenes import SubjectSource, subjects
from benchmarks.schema import Setting
from benchmarks.timing import CallClock, measure
from paravol.patient import load_patient, no_progress
from paravol.sessions.session_setup import (
    build_view,
    coverage_watch,
    first_views,
    operate_on,
    path_view,
)
from renderers.art import ActiveRayTracer
from renderers.fsr.surfels import SurfelRasterizer
from renderers.scene import Camera, Change, GBuffer, ImageError, image_error
from renderers.scene.thread_pool import ThreadPool
from scenarios import FrameState, tip_frame
from scenarios.coverage.watch import RATE_HZ
from surgery import solids
from surgery.edit import CuttingLimits, Edit
from surgery.film import STEPS_PER_S, BloodFilm
from surgery.injury import InjuryWatch
from surgery.patient import OperatedPatient
from surgery.pushing import Pushing, ToolCapsule

REBUILD, UPDATE = "full rebuild", "local update"
NEW_TRACER, TRACER_UPDATE = "new tracer", "tracer update"
DENT = "dent"
EDIT = "edit with books"
FILM = "blood film"
BLED_S, FILM_STEPS = 4.0, 45
"""So long blood runs before its steps are timed."""
PICTURED_MM = 30.0
RADII_MM = (1.0, 2.0, 3.0)
FINE_MM = 0.1
"""Of the points that a cut's volume is counted with, for comparison."""

WATCHED_HZ = 100
SHAFT_MM = 110.0
SCOPE_MM = 1.35
RADIUS_MM = 2.0
ROD_MM = 1.2
PLACES, QUICK_PLACES = 24, 3
SIZE = 128
SAMPLES = 10
"""Of a tool that comes 1 mm deep into a wall."""


class SurgeryPlan(Plan, suite="surgery"):
    """List and make the measurements of suite `surgery`."""

    def __init__(self, quick: bool) -> None:
        super().__init__(quick)
        self._source: SubjectSource = subjects(quick)[0]
        self._count = QUICK_PLACES if quick else PLACES
        self._budget_s = 0.3 if quick else 5.0
        self._watched_s = 2.0 if quick else bundled_flight()[1].duration_s
        self._pixels, self._pictures = (128, 12) if quick else (512, 48)
        self._pool = ThreadPool(1)
        self.stack.callback(self._pool.close)

    def tasks(self) -> list[Task]:
        """List the tasks, baselines first."""
        name = self._source.name
        places: dict[str, Setting] = {"places": self._count, "threads": 1}
        bites = places | {"radius_mm": RADIUS_MM}
        watched: dict[str, Setting] = {"threads": 1, "seconds": self._watched_s}
        shown: dict[str, Setting] = {"size": self._pixels, "threads": 2}
        trace = self._trace
        return [
            *self.compared(
                f"{name}/bite/surfels",
                {REBUILD: self._rebuild, UPDATE: self._update},
                bites | {"reference": REBUILD},
                cost_s=20.0,
                series=True,
            ),
            *self.compared(
                f"{name}/bite/tracer",
                {
                    NEW_TRACER: partial(trace, True),
                    TRACER_UPDATE: partial(trace, False),
                },
                bites | {"reference": NEW_TRACER},
                cost_s=30.0,
                series=True,
            ),
            self.task(
                f"{name}/tool/shown",
                DENT,
                self._dent,
                places | {"radius_mm": ROD_MM, "series": DENT},
                cost_s=20.0,
            ),
            self.task(
                f"{name}/bite/patient",
                EDIT,
                self._edit,
                places | {"series": EDIT},
                cost_s=10.0,
            ),
            self.task(
                f"{name}/blood/step",
                FILM,
                self._film,
                places | {"series": FILM},
                cost_s=10.0,
            ),
            self.task(
                "first_flight/sample/injuries",
                "injury watch",
                self._watch,
                watched | {"sample_hz": WATCHED_HZ},
                cost_s=20.0,
            ),
            self.task(
                "first_flight/look/mucosa",
                "mucosa watch",
                self._watch_mucosa,
                watched | {"look_hz": RATE_HZ},
                cost_s=20.0,
            ),
            self.task(
                "first_flight/bite/picture",
                "cut to picture",
                self._picture,
                shown | {"places": self._pictures},
                clock="wall",
                cost_s=60.0,
            ),
        ]

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

    def _bite(self, place: NDArray[np.float64]) -> Edit | None:
        return self._patient.carve(
            solids.capsule(place, place, RADIUS_MM), CuttingLimits()
        )

    @staticmethod
    def _before(place: NDArray[np.float64], out: NDArray[np.float64]) -> Camera:
        return Camera.looking_at(place + 3 * out, place, size=(SIZE, SIZE))

    def _heal(self) -> Iterator[Change]:
        """Undo all cuts; give the changes."""
        while (change := self._patient.undo()) is not None:
            yield change

    def _rebuild(self) -> Measured:
        surface = self._patient.surface
        timing, _ = measure(
            lambda: SurfelRasterizer(surface.distance), budget_s=self._budget_s, most=5
        )
        return Measured(timing, counters={"edit_ms": timing.cpu_s * 1e3})

    def _update(self) -> Measured:
        """Time a bite at a time; the error counts pixels that are not a rebuild's."""
        distance, clock = self._patient.surface.distance, CallClock()
        drawer = SurfelRasterizer(distance)
        for place, _ in self._places:
            if (edit := self._bite(place)) is not None:
                clock.time(partial(drawer.update, edit.change))
        fresh = SurfelRasterizer(distance)
        other = 0.0
        for place, out in self._places:
            camera = self._before(place, out)
            a, b = drawer.draw(camera, self._pool), fresh.draw(camera, self._pool)
            same = (a.depth_mm == b.depth_mm) & np.all(a.normal == b.normal, axis=-1)
            other += float(np.mean(~same)) / len(self._places)
        for change in self._heal():
            drawer.update(change)
        error, counters = share_error(other), clock.counters("edit")
        return Measured(clock.timing(), error, "share of pixels", counters)

    def _trace(self, is_new: bool) -> Measured:
        """Time the first picture after a cut; the error counts pixels unlike."""
        scene = replace(self._source.subject.scene, surface=self._patient.surface)
        tracer, clock = ActiveRayTracer(scene, threads=1), CallClock()
        other = 0.0

        def follow(camera: Camera, change: Change) -> GBuffer:
            drawer = ActiveRayTracer(scene, threads=1) if is_new else tracer
            if not is_new:
                tracer.update(change)
            return drawer.gbuffer(camera)

        for place, out in self._places[: QUICK_PLACES * 2]:
            camera = self._before(place, out)
            tracer.gbuffer(camera)
            if (edit := self._bite(place)) is None:
                continue
            shown = clock.time(partial(follow, camera, edit.change))
            fresh = ActiveRayTracer(scene, threads=1).gbuffer(camera)
            other += float(np.mean(shown.depth_mm != fresh.depth_mm))
            if is_new:
                tracer.update(edit.change)
        list(self._heal())
        error, counters = share_error(other), clock.counters("picture")
        return Measured(clock.timing(), error, "share of pixels", counters)

    def _dent(self) -> Measured:
        """Time a sample at a time: tissue bent, then its surfels followed."""
        pushing = Pushing(self._patient)
        drawer = SurfelRasterizer(pushing.surface.distance)
        bend, follow = CallClock(), CallClock()
        generation = 0
        for place, out in self._places:
            for depth in np.linspace(0.0, 1.0, SAMPLES):
                rod = ToolCapsule.of(place + (ROD_MM - depth) * out, out, ROD_MM)
                generation += 1
                sample = partial(pushing.push, generation / 60, generation, rod)
                change = bend.time(sample)
                if change is not None:
                    follow.time(partial(drawer.update, change))
            if (change := pushing.release(generation)) is not None:
                drawer.update(change)
        counters = bend.counters("bend") | follow.counters("surfels")
        return Measured(follow.timing(), counters=counters)

    def _edit(self) -> Measured:
        """Time a cut at a time; the error is its volume against its points'.

        Counter `unbalanced_counts` is what tissue and books together gained or lost.
        """
        patient, clock = self._patient, CallClock()
        unbalanced, errors = 0, []
        for n, (place, out) in enumerate(self._places):
            radius = RADII_MM[n % len(RADII_MM)]
            end = place - 3 * out
            before = int(patient.fill.sum(dtype=np.int64))
            solid = solids.capsule(place, end, radius)
            edit = clock.time(partial(patient.carve, solid, CuttingLimits()))
            if edit is None:
                continue
            after = int(patient.fill.sum(dtype=np.int64))
            unbalanced += abs(before - after - edit.counts)
            exact = _tissue_mm3(patient, place, end, radius)
            errors.append((edit.volume_mm3 - exact) / exact)
            patient.undo()
        return Measured(
            clock.timing(),
            image_error(np.array(errors), np.zeros(len(errors))),
            "share of the volume",
            clock.counters("edit") | {"unbalanced_counts": float(unbalanced)},
        )

    def _film(self) -> Measured:
        """Time blood a step at a time; the error is what the books gained or lost."""
        patient = self._patient
        film, clock = BloodFilm(patient.surface, patient.wounds_film), CallClock()
        film.advance(0.0)
        for place, _ in self._places:
            if (edit := self._bite(place)) is not None:
                film.after_edit(edit.change)
        film.advance(BLED_S)
        for step in range(FILM_STEPS):
            clock.time(partial(film.advance, BLED_S + (step + 1.5) / STEPS_PER_S))
        books = film.books
        gone = int(books.bled.sum()) - film.held - books.sucked - int(books.left.sum())
        wet = float(film.wet_cells)
        list(self._heal())
        patient.wounds_film[...] = 0
        return Measured(
            clock.timing(),
            ImageError(rmse=float(abs(gone)), p999=0.0, max=float(abs(gone)), bias=0.0),
            "units of a nanolitre",
            clock.counters("step") | {"wet_cells": wet},
        )

    def _picture(self) -> Measured:
        """Time from a cut to the frame that shows it, on the bundled flight."""
        scenario, path = bundled_flight()
        head, operation = operate_on(load_patient(scenario, no_progress))
        size = (self._pixels, self._pixels)
        view = build_view(scenario, head, threads=2)
        view.warm_up(first_views(scenario, head, path, size), no_progress)
        clock, middle = CallClock(), self._pixels // 2
        for n in range(self._pictures):
            time_s = (n + 0.5) * path.duration_s / self._pictures
            seen = path_view(scenario, head, path, time_s, size)
            depth = float(view.tissue(seen).depth_mm[middle, middle])
            if not 0.0 < depth < PICTURED_MM:
                continue
            place = seen.camera.frame[0] + depth * seen.camera.frame[3]
            solid = solids.capsule(place, place, RADIUS_MM)

            def show(
                solid: solids.Rows = solid, seen: FrameState = seen, number: int = n
            ) -> None:
                edit = operation.patient.carve(solid, CuttingLimits(20.0, 1.0))
                if edit is not None:
                    view.apply([operation.pushing.follow(edit.change)])
                view.draw(seen, number=number, elapsed_s=1 / 60)

            clock.time(show)
        counters = clock.counters("cpu")
        walls = np.array(clock.walls[1:]) * 1e3
        counters["picture_ms"] = float(np.median(walls))
        counters["picture_ms_95_percent"] = float(np.percentile(walls, 95))
        return Measured(clock.timing(), counters=counters)

    def _watch(self) -> Measured:
        """Time the watch a sample at a time on the bundled flight."""
        head = sinus_phantom()
        watch = InjuryWatch(head.hazards, head.layers, head.distance)
        path, clock = bundled_flight()[1], CallClock()
        for n in range(round(self._watched_s * WATCHED_HZ)):
            time_s = n / WATCHED_HZ
            state = path.sample(time_s)
            pose = tip_frame(state.tip_mm, state.axis)
            end = pose[:3, 3] + SCOPE_MM * pose[:3, 2]
            scope = solids.capsule(end, end + SHAFT_MM * pose[:3, 2], SCOPE_MM)
            clock.time(partial(watch.move, "endoscope", time_s, scope))
        return Measured(clock.timing(), counters=clock.counters("sample"))

    def _watch_mucosa(self) -> Measured:
        """Time the watch of what is seen a look at a time on the bundled flight."""
        scenario, path = bundled_flight()
        patient = load_patient(scenario, no_progress)
        watch, clock = coverage_watch(patient), CallClock()
        scope, distance = scenario.scope.endoscope(), patient.surface.distance
        for n in range(round(self._watched_s * RATE_HZ)):
            time_s = (n + 0.5) / RATE_HZ
            state = path.sample(time_s)
            pose = tip_frame(state.tip_mm, state.axis)
            camera = scope.camera(pose, state.roll_deg, (SIZE, SIZE))
            clock.time(partial(watch.step, time_s, camera, distance))
        counters = clock.counters("look")
        counters["share_of_a_core"] = 1e-3 * counters["look_ms"] * RATE_HZ
        return Measured(clock.timing(), counters=counters)


def _tissue_mm3(
    patient: OperatedPatient,
    begin: NDArray[np.float64],
    end: NDArray[np.float64],
    radius: float,
) -> float:
    """Count the points of a capsule that lie in tissue, by the pristine distance."""
    low = np.minimum(begin, end) - radius
    count = np.ceil((np.maximum(begin, end) + radius - low) / FINE_MM).astype(int)
    axes = [low[a] + FINE_MM * (np.arange(count[a]) + 0.5) for a in range(3)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    way = end - begin
    along = np.clip((points - begin) @ way / (way @ way), 0.0, 1.0)
    off = np.linalg.norm(points - begin - along[:, None] * way, axis=1)
    depth = patient.pristine.distance.sample(points[off <= radius])
    return float(np.count_nonzero(depth > 0)) * FINE_MM**3
