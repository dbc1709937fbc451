"""Samples where they matter most: error against the share of the samples spent."""

import math
import tempfile
import time
from functools import cached_property, partial
from pathlib import Path

import msgspec
import numpy as np
from numpy.typing import NDArray

from benchmarks.nasal_views import acceptance_views, nasal_scene
from benchmarks.plan import Measured, Plan, Task
from benchmarks.schema import Setting
from benchmarks.timing import Timing
from renderers.scene import ImageError, Scene, image_error
from renderers.snapshots.client import SnapshotClient
from renderers.snapshots.delivery import Finisher, Picture
from renderers.snapshots.refinement import Refinement
from renderers.snapshots.request import SnapshotRequest
from renderers.snapshots.scene_loader import load_scene
from renderers.snapshots.team import SerialTeam

Codes = NDArray[np.float64]

WHOLE = "four samples everywhere"
SHARES = (0.0, 0.125, 0.25, 0.5, 1.0)
"""Of the pixels that get four samples; the others have one."""
TOLERANCES = (2.0, 1.0, 0.5)
"""Codes that the error is to be estimated at."""


class _Case:
    """One view as the service draws it."""

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
        super().__init__(quick)
        self._size = 128 if quick else 512
        self._count = 2 if quick else 6

    def tasks(self) -> list[Task]:
        """List the tasks, the whole picture first."""
        settings: dict[str, Setting] = {
            "size": self._size,
            "views": self._count,
            "threads": 1,
        }
        case = "nose/views/refinement"
        found = [self.task(case, WHOLE, self._whole, settings, cost_s=20.0)]
        runs: list[tuple[str, float, dict[str, Setting]]] = [
            (f"four samples for {share:.1%}", 0.0, {"share": share}) for share in SHARES
        ]
        runs += [(f"to {t:g} codes", t, {"tolerance": t}) for t in TOLERANCES]
        for mode, tolerance, told in runs:
            run = partial(self._refined, float(told.get("share", 1.0)), tolerance)
            told = settings | told | {"reference": WHOLE}
            found.append(self.task(case, mode, run, told, WHOLE, cost_s=20.0))
        return found

    @cached_property
    def _cases(self) -> list[_Case]:
        folder = self.stack.enter_context(tempfile.TemporaryDirectory())
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
