"""What a change of the tissue costs: derived objects followed locally or made anew."""

import time
from collections.abc import Callable
from dataclasses import replace
from functools import cached_property, partial
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from anatomy import sinus_phantom
from benchmarks.nasal_views import bundled_flight
from benchmarks.plan import Measured, Plan, Task
from benchmarks.scenes import SubjectSource, subjects
from benchmarks.schema import Setting
from benchmarks.timing import Timing, measure
from paravol.patient import load_patient
from paravol.session_setup import (
    LIVE_TIER,
    SEED,
    build_view,
    coverage_watch,
    first_views,
    operate_on,
    path_view,
)
from paravol.snapshots.operated_head import OperatedHead
from renderers.art import ActiveRayTracer
from renderers.fsr.surfels import SurfelRasterizer
from renderers.scene import Camera, Change, GBuffer, ImageError
from renderers.scene.lens_state import CLEAN, LensState, all_over
from renderers.scene.thread_team import ThreadTeam
from renderers.shading import CameraPass, ScopeLight, ScopeShader, Tier
from scenarios import View, tip_frame
from scenarios.coverage.watch import RATE_HZ
from surgery import solids
from surgery.edit import Taker
from surgery.film import STEPS_PER_S, BloodFilm
from surgery.force import MOST_BALLS, feel_tables, whole_patch
from surgery.injury import InjuryWatch
from surgery.kernels import touch_force as tick
from surgery.patient import OperatedPatient
from surgery.pushing import Pushing, Rod

REBUILD = "full rebuild"
UPDATE = "local update"
DENT = "dent"
EDIT = "edit with books"
FIRST_COPY, LATER_COPY = "copy of one cut", "copy of all cuts"
NEW_TRACER, TRACER_UPDATE = "new tracer", "tracer update"
WATCH = "injury watch"
DEEP_WATCH = "injury watch deep inside"
MUCOSA_WATCH = "mucosa watch"
PICTURE = "cut to picture"
FILM = "blood film"
READ, TICK, COLD_TICK = "distance at 200 balls", "tick of force", "cold tick of force"
TICKS = 2000
FLUSHED = 4_000_000
"""Numbers that are written between cold ticks, 16 MB: more than caches hold."""
THIN_MM = 0.8
"""Radius of the tool whose force is timed."""
HEALED, WOUNDED = "light without wounds", "light on a wound"
CLEAR, SOILED = "clean lens", "soiled lens"
WOUND_SIZE = 256
BLED_S, FILM_STEPS = 4.0, 45
"""So long blood runs before its steps are timed."""
PICTURED_MM = 30.0
RADII_MM = (1.0, 2.0, 3.0)
FINE_MM = 0.1
"""Of the points that a cut's volume is counted with, for comparison."""

WATCHED_HZ = 100
JUMP_MM, JUMPS = 4.0, 40
"""Spread of a tool that jumps about where a hazard is deepest, and how often."""
SHAFT_MM = 110.0
SCOPE_MM = 1.35
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
        self._watched_s = 2.0 if quick else bundled_flight()[1].duration_s
        self._pixels, self._pictures = (128, 12) if quick else (512, 48)
        self._team = ThreadTeam(1)

    def tasks(self) -> list[Task]:
        """List the tasks, baselines first."""
        settings: dict[str, Setting] = {
            "radius_mm": RADIUS_MM,
            "places": self._count,
            "threads": 1,
        }
        name = self._source.name
        size: dict[str, Setting] = {"size": WOUND_SIZE, "threads": 1}
        places: dict[str, Setting] = {"places": self._count, "threads": 1}
        return [
            *self._pair(
                f"{name}/bite/surfels",
                {REBUILD: self._rebuild, UPDATE: self._update},
                settings,
                20.0,
            ),
            self.task(
                f"{name}/tool/shown",
                DENT,
                self._dent,
                places | {"radius_mm": ROD_MM, "series": DENT},
                cost_s=20.0,
            ),
            *(
                self.task(case, mode, work, places | {"series": mode}, cost_s=10.0)
                for case, mode, work in (
                    (f"{name}/bite/patient", EDIT, self._edit),
                    (f"{name}/blood/step", FILM, self._film),
                )
            ),
            *(
                self.task(
                    f"{name}/snapshot/copy",
                    mode,
                    partial(self._copy, count),
                    {"cuts": count, "series": mode, "reference": FIRST_COPY},
                    baseline=None if mode == FIRST_COPY else FIRST_COPY,
                    cost_s=5.0,
                )
                for mode, count in ((FIRST_COPY, 1), (LATER_COPY, self._count))
            ),
            *self._pair(
                f"{name}/bite/tracer",
                {
                    NEW_TRACER: partial(self._trace, True),
                    TRACER_UPDATE: partial(self._trace, False),
                },
                settings,
                30.0,
            ),
            *self._pair(
                f"{name}/wound/light",
                {
                    HEALED: partial(self._wounded, False),
                    WOUNDED: partial(self._wounded, True),
                },
                size,
                10.0,
            ),
            *self._pair(
                f"{name}/lens/picture",
                {
                    CLEAR: partial(self._lens, CLEAN),
                    SOILED: partial(self._lens, LensState(all_over(0.4), fog=0.3)),
                },
                size,
                5.0,
            ),
            *self._force_tasks(),
            *self._watching_tasks(),
        ]

    def _watching_tasks(self) -> list[Task]:
        """List the tasks that follow a flight."""
        shown: dict[str, Setting] = {"size": self._pixels, "places": self._pictures}
        watched: dict[str, Setting] = {"sample_hz": WATCHED_HZ, "threads": 1}
        return [
            self.task(
                "first_flight/sample/injuries",
                WATCH,
                self._watch,
                watched | {"seconds": self._watched_s},
                cost_s=20.0,
            ),
            self.task(
                "first_flight/look/mucosa",
                MUCOSA_WATCH,
                self._watch_mucosa,
                {"look_hz": RATE_HZ, "threads": 1, "seconds": self._watched_s},
                cost_s=20.0,
            ),
            self.task(
                "phantom/sample/deep",
                DEEP_WATCH,
                self._watch_deep,
                watched | {"jump_mm": JUMP_MM, "samples": JUMPS},
                cost_s=20.0,
            ),
            self.task(
                "first_flight/bite/picture",
                PICTURE,
                self._picture,
                shown | {"threads": 2},
                clock="wall",
                cost_s=60.0,
            ),
        ]

    def _pair(
        self,
        name: str,
        works: dict[str, Callable[[], Measured]],
        settings: dict[str, Setting],
        cost_s: float,
    ) -> list[Task]:
        """List tasks that are compared with the first of them."""
        first = next(iter(works))
        return [
            self.task(
                name,
                mode,
                work,
                settings | {"series": mode, "reference": first},
                baseline=None if mode == first else first,
                cost_s=cost_s,
            )
            for mode, work in works.items()
        ]

    def _force_tasks(self) -> list[Task]:
        """List a tick of force, and what reads alone cost."""
        return [
            self.task(
                "first_flight/tick/force",
                mode,
                work,
                {"balls": MOST_BALLS, "threads": 1, "series": mode, "reference": READ},
                baseline=None if mode == READ else READ,
                cost_s=5.0,
            )
            for mode, work in (
                (READ, partial(self._force, True, False)),
                (TICK, partial(self._force, False, False)),
                (COLD_TICK, partial(self._force, False, True)),
            )
        ]

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

    def _edit(self) -> Measured:
        """Time a cut at a time; the error is its volume against its points'.

        Counter `unbalanced_counts` is what tissue and books together gained or lost.
        """
        patient, clock = self._patient, _Clock()
        unbalanced, errors = 0, []
        for n, (place, out) in enumerate(self._places):
            radius = RADII_MM[n % len(RADII_MM)]
            end = place - 3 * out
            before = int(patient.fill.sum(dtype=np.int64))
            solid = solids.capsule(place, end, radius)
            edit = clock.time(partial(patient.carve, solid, Taker()))
            if edit is None:
                continue
            after = int(patient.fill.sum(dtype=np.int64))
            unbalanced += abs(before - after - edit.counts)
            exact = _tissue_mm3(patient, place, end, radius)
            errors.append((edit.volume_mm3 - exact) / exact)
            patient.undo()
        off = np.array(errors)
        return Measured(
            clock.timing(),
            ImageError(
                float(np.sqrt(np.mean(off**2))),
                float(np.percentile(np.abs(off), 99.9)),
                float(np.abs(off).max()),
                float(off.mean()),
            ),
            "share of the volume",
            clock.counters("edit") | {"unbalanced_counts": float(unbalanced)},
        )

    def _film(self) -> Measured:
        """Time blood a step at a time; the error is what the books gained or lost."""
        patient = self._patient
        film, clock = BloodFilm(patient.surface, patient.wounds_film), _Clock()
        film.advance(0.0)
        for place, _ in self._places:
            edit = patient.carve(solids.capsule(place, place, RADIUS_MM), Taker())
            if edit is not None:
                film.after_edit(edit.change)
        film.advance(BLED_S)
        for step in range(FILM_STEPS):
            clock.time(partial(film.advance, BLED_S + (step + 1.5) / STEPS_PER_S))
        books = film.books
        gone = int(books.bled.sum()) - film.held - books.sucked - int(books.left.sum())
        wet = float(film.wet_cells)
        while patient.undo() is not None:
            pass
        patient.wounds_film[...] = 0
        return Measured(
            clock.timing(),
            ImageError(rmse=float(abs(gone)), p999=0.0, max=float(abs(gone)), bias=0.0),
            "units of a nanolitre",
            clock.counters("step") | {"wet_cells": wet},
        )

    def _wounded(self, has_wounds: bool) -> Measured:
        """Time the light of a picture full of a wound, or of the same shape unhurt."""
        patient = self._patient
        place, out = self._places[0]
        patient.carve(solids.capsule(place, place, 3.0, rough_mm=0.15), Taker())
        surface = patient.surface
        if not has_wounds:
            surface = replace(surface, wounds=None)
        camera = Camera.looking_at(
            place + 3 * out, place, size=(WOUND_SIZE, WOUND_SIZE)
        )
        scene = replace(self._source.subject.scene, surface=surface)
        buffer = ActiveRayTracer(scene, threads=1).gbuffer(camera)
        shader, light = ScopeShader(surface, Tier.LIVE, threads=1), ScopeLight(0.95)
        timing, _ = measure(
            lambda: shader.shade(buffer, camera, light),
            budget_s=self._budget_s,
            most=15,
        )
        seen = np.isfinite(buffer.depth_mm)
        rays = camera.rays()[1][seen]
        points = camera.eye_mm + buffer.depth_mm[seen][:, None] * rays
        depth = patient.pristine.distance.sample(points)
        while patient.undo() is not None:
            pass
        return Measured(
            timing,
            counters={
                "light_ms": timing.cpu_s * 1e3,
                "wounded_pixels": float(np.count_nonzero(depth > 0.1)),
            },
        )

    def _lens(self, state: LensState) -> Measured:
        """Time the camera through a lens."""
        size = WOUND_SIZE, WOUND_SIZE
        place, out = self._places[0]
        camera = Camera.looking_at(place + 3 * out, place, size=size)
        radiance = np.random.default_rng(1).random((*size, 3)).astype(np.float32)
        buffer, camera_pass = GBuffer.empty(*size), CameraPass(threads=1)
        timing, _ = measure(
            lambda: camera_pass.finish(radiance, buffer, camera, gain=1.0, lens=state),
            budget_s=self._budget_s,
            most=15,
        )
        return Measured(timing, counters={"camera_ms": timing.cpu_s * 1e3})

    def _copy(self, count: int) -> Measured:
        """Time what a snapshot's request copies after so many cuts."""
        patient = self._patient
        for place, _ in self._places[:count]:
            patient.carve(solids.capsule(place, place, RADIUS_MM), Taker())
        timing, _ = measure(
            partial(OperatedHead.of, patient), budget_s=self._budget_s, most=15
        )
        while patient.undo() is not None:
            pass
        patient.touched = None
        return Measured(
            timing,
            counters={"copy_ms": timing.cpu_s * 1e3},
        )

    def _trace(self, is_new: bool) -> Measured:
        """Time the first picture after a cut; the error counts pixels unlike."""
        patient = self._patient
        scene = replace(self._source.subject.scene, surface=patient.surface)
        tracer, clock = ActiveRayTracer(scene, threads=1), _Clock()
        other = 0.0
        for place, out in self._places[: QUICK_PLACES * 2]:
            camera = Camera.looking_at(place + 3 * out, place, size=(SIZE, SIZE))
            tracer.gbuffer(camera)
            edit = patient.carve(solids.capsule(place, place, RADIUS_MM), Taker())
            if edit is None:
                continue

            def follow(seen: Camera = camera, change: Change = edit.change) -> GBuffer:
                drawer = tracer
                if is_new:
                    drawer = ActiveRayTracer(scene, threads=1)
                else:
                    drawer.update(change)
                return drawer.gbuffer(seen)

            shown = clock.time(follow)
            fresh = ActiveRayTracer(scene, threads=1).gbuffer(camera)
            other += float(np.mean(shown.depth_mm != fresh.depth_mm))
            tracer.update(edit.change)
        while patient.undo() is not None:
            pass
        return Measured(
            clock.timing(),
            ImageError(rmse=other, p999=0.0, max=float(other > 0), bias=other),
            "share of pixels",
            clock.counters("picture"),
        )

    def _picture(self) -> Measured:
        """Time from a cut to the frame that shows it, on the bundled flight."""
        scenario, path = bundled_flight()
        head, operation = operate_on(load_patient(scenario, _quietly))
        size = (self._pixels, self._pixels)
        view = build_view(
            scenario,
            head,
            tier=LIVE_TIER,
            seed=SEED,
            has_instrument=True,
            threads=2,
        )
        view.warm_up(first_views(scenario, head, path, size), _quietly)
        clock, middle = _Clock(), self._pixels // 2
        for n in range(self._pictures):
            time_s = (n + 0.5) * path.duration_s / self._pictures
            seen = path_view(scenario, head, path, time_s, size)
            depth = float(view.tissue(seen).depth_mm[middle, middle])
            if not 0.0 < depth < PICTURED_MM:
                continue
            place = seen.camera.frame[0] + depth * seen.camera.frame[3]
            solid = solids.capsule(place, place, RADIUS_MM)

            def show(
                solid: solids.Rows = solid, seen: View = seen, number: int = n
            ) -> None:
                edit = operation.patient.carve(solid, Taker(20.0, 1.0))
                if edit is not None:
                    view.apply([operation.pushing.follow(edit.change)])
                view.draw(seen, number=number, elapsed_s=1 / 60)

            clock.time(show)
        counters = clock.counters("cpu")
        walls = np.array(clock.walls[1:]) * 1e3
        counters["picture_ms"] = float(np.median(walls))
        counters["picture_ms_95_percent"] = float(np.percentile(walls, 95))
        return Measured(clock.timing(), counters=counters)

    def _force(self, is_read: bool, is_cold: bool) -> Measured:
        """Time ticks of a tool that slides along walls, one call each.

        is_read: its distances alone. The scope's shaft of the bundled flight, ahead
        until it touches, goes to and fro by a hundredth of a millimetre a tick, half of
        the time up to 0.5 mm into the wall. Counter `touching` is that share.
        """
        patient = self._patient
        patch = whole_patch(patient)
        walls, grounds = feel_tables(patient.layers)
        path = bundled_flight()[1]
        seen = path.sample(0.5 * path.duration_s)
        frame = tip_frame(seen.tip_mm, seen.axis)
        balls = np.zeros((MOST_BALLS, 4))
        balls[:, 2] = np.linspace(THIN_MM, 60.0, MOST_BALLS)
        balls[:, 3] = THIN_MM
        start, ahead = frame[:3, 3].copy(), -frame[:3, 2]
        way = np.arange(0.0, 30.0, 0.05)[:, None]
        gaps = -patient.surface.distance.sample(start + (way - THIN_MM) * ahead)
        start += float(way[np.argmax(gaps < THIN_MM), 0]) * ahead
        state, result = np.zeros(tick.STATE), np.zeros(tick.OUT)
        holes = np.zeros((tick.MOST_HOLES, tick.HOLE))
        work = np.zeros((MOST_BALLS + tick.BEHIND, tick.WORK))
        settings = np.zeros(tick.SETTINGS)
        settings[[tick.DT, tick.PERIOD]] = 1e-3
        settings[tick.STIFFEST] = settings[tick.MOST_N] = np.inf
        still, flushed = np.zeros(3), np.zeros(FLUSHED, np.float32)
        clock, touches = _Clock(), 0
        count = TICKS // 20 if is_cold else TICKS
        for n in range(count):
            depth = 0.5 * np.sin(n / 50)
            frame[:3, 3] = start + depth * ahead
            if is_cold:
                flushed += 1.0
            if is_read:
                clock.time(
                    partial(
                        tick.place_balls,
                        patch.distance,
                        patch.voxel,
                        holes,
                        0,
                        balls,
                        frame,
                        still,
                        0.0,
                        work,
                    )
                )
                continue
            clock.time(
                partial(
                    tick.touch_tick,
                    *(patch, walls, grounds, balls, frame, settings),
                    *(state, holes, work, result),
                )
            )
            touches += int(result[tick.PASSES] > 0)
        counters = clock.counters("tick") | {"touching": touches / count}
        return Measured(clock.timing(), counters=counters)

    def _watch(self) -> Measured:
        """Time the watch a sample at a time on the bundled flight."""
        head = sinus_phantom()
        watch = InjuryWatch(head.hazards, head.layers, head.distance)
        path, clock = bundled_flight()[1], _Clock()
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
        patient = load_patient(scenario, _quietly)
        watch, clock = coverage_watch(patient), _Clock()
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

    def _watch_deep(self) -> Measured:
        """Time the watch while a tool jumps about deep inside the skull base."""
        head = sinus_phantom()
        watch = InjuryWatch(head.hazards, head.layers, head.distance)
        hazard = head.hazards.volumes["skull base"]
        deepest = np.unravel_index(np.argmin(hazard.values), hazard.shape)
        matrix, clock = hazard.world_from_voxel, _Clock()
        place = matrix[:3, :3] @ np.array(deepest[::-1], np.float64) + matrix[:3, 3]
        rng = np.random.default_rng(22)
        for n in range(JUMPS):
            end = place + rng.normal(0.0, JUMP_MM, 3)
            axis = np.array([0.0, -0.3, 1.0]) + rng.normal(0.0, 0.05, 3)
            scope = solids.capsule(end, end + SHAFT_MM * axis, SCOPE_MM)
            clock.time(partial(watch.move, "endoscope", n / WATCHED_HZ, scope))
        return Measured(clock.timing(), counters=clock.counters("sample"))


def _quietly(stage: str, share: float) -> None:
    """Say nothing about progress."""


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


class _Clock:
    """Time calls; the first, which compiles or finds nothing prepared, is left out."""

    def __init__(self) -> None:
        self.walls: list[float] = []
        self._cpus: list[float] = []

    def time(self, call: Callable[[], Result]) -> Result:
        """Call and keep what it took."""
        cpu, wall = time.process_time(), time.perf_counter()
        result = call()
        self.walls.append(time.perf_counter() - wall)
        self._cpus.append(time.process_time() - cpu)
        return result

    def timing(self) -> Timing:
        """Return the times of the calls."""
        return Timing.of(self.walls[1:], self._cpus[1:])

    def counters(self, what: str) -> dict[str, float]:
        """Return milliseconds of CPU time of a median call and of one in twenty."""
        ms = np.array(self._cpus[1:]) * 1e3
        return {
            f"{what}_ms": float(np.median(ms)),
            f"{what}_ms_95_percent": float(np.percentile(ms, 95)),
            f"{what}_calls": len(ms),
        }
