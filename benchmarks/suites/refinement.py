"""Samples where they matter most: error against the share of the samples spent."""

import math
import tempfile
import time
from contextlib import ExitStack
from functools import cached_property, partial
from pathlib import Path

import msgspec
import numpy as np
from numpy.typing import NDArray

from benchmarks.nasal_views import acceptance_views, nasal_scene
from benchmarks.plan import Measured, Plan, Task
from benchmarks.schema import Setting
from benchmarks.timing import Timing
from renderers.art import ActiveRayTracer
from renderers.scene import ImageError, Scene, image_error
from renderers.shading import ScopeShader, Tier
from renderers.shading.path_sampling import PathSampling
from renderers.shading.path_tracer import PathTracer, SeenWalls
from renderers.snapshots.client import SnapshotClient
from renderers.snapshots.delivery import Finisher, Picture
from renderers.snapshots.refinement import Refinement
from renderers.snapshots.request import SnapshotRequest
from renderers.snapshots.scene_loader import load_scene
from renderers.snapshots.team import SerialTeam

Codes = NDArray[np.float64]

URGENT, RASTER = "paths, what matters most first", "paths, row by row"
"""Orders of random paths."""
WHOLE = "four samples everywhere"
BATCHES = 4
"""Of 16 paths a ray, on average, when light by paths is stopped."""
TRUTH_BATCHES = 64
SHARES = (0.0, 0.125, 0.25, 0.5, 1.0)
"""Of the pixels that get four samples; the others have one."""
TOLERANCES = (2.0, 1.0, 0.5)
"""Codes that the error is to be estimated at."""


class _Case:
    """Hold one view as the service draws it."""

    def __init__(self, client: SnapshotClient, request: SnapshotRequest) -> None:
        self.request = msgspec.structs.replace(request, tolerance=0.0)
        self.scene: Scene = load_scene(client.data, request)
        self.team = SerialTeam(1)
        self.finisher = Finisher(client.data, 1)

    @cached_property
    def whole(self) -> tuple[Picture, float]:
        """Draw with all samples at once; give the seconds, too."""
        self._draw()
        begun = time.process_time()
        return self._draw(), time.process_time() - begun

    def _draw(self) -> Picture:
        traced = self.team.trace(self.request, self.scene, lambda share: True)
        return self.finisher.finish(self.request, self.scene, traced)

    def refined(self, share: float, tolerance: float = 0.0) -> tuple[Picture, float]:
        """Refine a share of the tiles, or to a tolerance; give the seconds, too."""
        begun = time.process_time()
        request = msgspec.structs.replace(self.request, tolerance=tolerance)
        found = Refinement(
            self.team, self.finisher, request, self.scene, lambda share: True
        )
        while found.share < share and not found.is_done:
            found.step()
        picture = found.picture()
        return picture, time.process_time() - begun


def shown(picture: Picture) -> NDArray[np.bool_]:
    """Mark the pixels that show something, within the field's stop."""
    height, width = picture.coverage.shape
    rows, columns = (np.arange(n) + 0.5 - n / 2 for n in (height, width))
    inside = np.hypot(rows[:, None], columns) <= min(height, width) / 2
    return np.asarray((picture.coverage > 0) & inside)


def encoded(picture: Picture, seen: NDArray[np.bool_], gain: float) -> Codes:
    """Encode the light of the pixels seen by one gain, 0 to 1."""
    light = picture.radiance[seen].astype(np.float64) * gain
    return np.asarray(np.clip(light, 0, 1) ** (1 / 2.2))


class RefinementPlan(Plan, suite="refinement"):
    """List and make the measurements of suite `refinement`."""

    def __init__(self, quick: bool) -> None:
        self._size = 128 if quick else 512
        self._count = 2 if quick else 6
        self._path_px = 48 if quick else 96
        self._stack = ExitStack()

    def tasks(self) -> list[Task]:
        """List the tasks, the whole picture first."""
        settings: dict[str, Setting] = {
            "size": self._size,
            "views": self._count,
            "threads": 1,
        }
        case = "nose/views/refinement"
        return [
            self.task(case, WHOLE, self._whole, settings, cost_s=20.0),
            *(
                self.task(
                    case,
                    f"four samples for {share:.1%}",
                    partial(self._refined, share),
                    settings | {"share": share, "reference": WHOLE},
                    baseline=WHOLE,
                    cost_s=20.0,
                )
                for share in SHARES
            ),
            *(
                self.task(
                    case,
                    f"to {tolerance:g} codes",
                    partial(self._refined, 1.0, tolerance),
                    settings | {"tolerance": tolerance, "reference": WHOLE},
                    baseline=WHOLE,
                    cost_s=20.0,
                )
                for tolerance in TOLERANCES
            ),
            *(
                self.task(
                    "nose/views/paths",
                    name,
                    partial(self._paths, name),
                    settings | {"size": self._path_px, "batches": BATCHES},
                    baseline=None if name == RASTER else RASTER,
                    cost_s=30.0,
                )
                for name in (RASTER, URGENT)
            ),
        ]

    def close(self) -> None:
        """Remove the volumes."""
        self._stack.close()

    @cached_property
    def _cases(self) -> list[_Case]:
        folder = self._stack.enter_context(tempfile.TemporaryDirectory())
        client = SnapshotClient(Path(folder))
        cases = []
        for view in acceptance_views(self._size)[: self._count]:
            surface = nasal_scene(view.head).surface
            assert surface is not None
            request = client.request_scope(
                surface, view.camera, ring_radius_mm=view.light.ring_radius_mm
            )
            cases.append(_Case(client, request))
        return cases

    def _whole(self) -> Measured:
        spent = sum(case.whole[1] for case in self._cases)
        return Measured(Timing(spent, spent, spent, len(self._cases)))

    def _refined(self, share: float, tolerance: float = 0.0) -> Measured:
        spent, told, apart = 0.0, [], []
        samples = []
        for case in self._cases:
            expected, _ = case.whole
            found, seconds = case.refined(share, tolerance)
            spent += seconds
            gain = expected.gain or 1.0
            seen = shown(expected)
            apart.append(encoded(found, seen, gain) - encoded(expected, seen, gain))
            told.append(found.error or 0.0)
            samples.append(float(found.samples[seen].mean()) / 4)
        total = np.concatenate(apart)
        error: ImageError = image_error(total, np.zeros_like(total))
        counters = {
            "share of samples": float(np.mean(samples)),
            "error told, codes rms": math.sqrt(float(np.mean(np.square(told)))),
            "error found, codes rms": 255 * error.rmse,
        }
        timing = Timing(spent, spent, spent, len(self._cases))
        return Measured(timing, error, "encoded light", counters)

    @cached_property
    def _walls(self) -> list[tuple[PathTracer, SeenWalls, Codes]]:
        """Return views' walls with weights, and their light by many other paths."""
        found = []
        for view in acceptance_views(self._path_px)[: self._count]:
            scene = nasal_scene(view.head)
            assert scene.surface is not None
            buffer = ActiveRayTracer(scene, threads=1).gbuffer(view.camera)
            shader = ScopeShader(scene.surface, Tier.FULL, threads=1)
            weight = shader.reflectance(buffer, view.camera, view.light)
            shader.close()
            walls = SeenWalls.of(buffer, view.camera, view.light, weight)
            other = PathTracer(scene.surface, seed=99, threads=1)
            truth = np.zeros((*buffer.size, 3))
            for batch in range(TRUTH_BATCHES):
                other.walk(walls, batch, whole_of(walls), truth, np.zeros_like(truth))
            tracer = PathTracer(scene.surface, threads=1)
            found.append((tracer, walls, truth / TRUTH_BATCHES))
        return found

    def _paths(self, name: str) -> Measured:
        """Stop light by paths early; the error of what it adds to the picture."""
        apart, noise, spent = [], [], 0.0
        for tracer, walls, truth in self._walls:
            assert walls.weight is not None
            begun = time.process_time()
            if name == RASTER:
                light = np.zeros_like(truth)
                for batch in range(BATCHES):
                    tracer.walk(
                        walls, batch, whole_of(walls), light, np.zeros_like(light)
                    )
                light /= BATCHES
            else:
                sampling = PathSampling(tracer, walls)
                for _ in range(BATCHES * sampling.blocks):
                    sampling.step()
                light = sampling.light().irradiance.astype(np.float64)
                noise.append(sampling.noise())
            spent += time.process_time() - begun
            unit = float((walls.weight * truth)[walls.shown].mean())
            apart.append((walls.weight * (light - truth))[walls.shown] / unit)
        total = np.concatenate(apart)
        error = image_error(total, np.zeros_like(total))
        counters = {"noise told": float(np.mean(noise))} if noise else {}
        timing = Timing(spent, spent, spent, len(self._walls))
        return Measured(timing, error, "mean bounced light", counters)


def whole_of(walls: SeenWalls) -> tuple[int, int, int, int]:
    """Return a view's rows and columns as a block."""
    return 0, walls.shown.shape[0], 0, walls.shown.shape[1]
