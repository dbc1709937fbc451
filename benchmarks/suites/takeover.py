"""A job whose worker died at four fifths: begun anew, and gone on with."""

import tempfile
import time
from functools import cached_property, partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.nasal_views import acceptance_views, nasal_scene
from benchmarks.plan import Measured, Plan, Task, UnavailableError
from benchmarks.scenes import subjects
from benchmarks.timing import Timing
from renderers.scene import Projection, image_error
from renderers.snapshots.client import SnapshotClient
from renderers.snapshots.request import PathTracingSpec, SnapshotRequest
from renderers.snapshots.saved_work import forget_saved
from renderers.snapshots.spool import SAVE_EVERY_S
from renderers.snapshots.worker import run_worker

UNDISTURBED = "nobody dies"
ANEW = "begun anew"
GONE_ON = "gone on with"
MODES = UNDISTURBED, ANEW, GONE_ON
RAYS, PATHS = "rays", "light by paths"

DIES_AT = 0.8
"""Share of the job that is done when its worker dies."""

LEASE_S = 0.05
UNIT = "linear light"


class TakeoverPlan(Plan, suite="takeover"):
    """List and make the measurements of suite `takeover`."""

    def __init__(self, quick: bool) -> None:
        super().__init__(quick)
        # small pictures are finished before they are saved at the usual pace
        self._every_s = 0.05 if quick else SAVE_EVERY_S
        self._repeats = 1 if quick else 3
        scratch = tempfile.TemporaryDirectory(prefix="paravol-takeover-")
        self._folder = Path(self.stack.enter_context(scratch))
        self._whole: dict[str, NDArray[np.float32]] = {}

    def tasks(self) -> list[Task]:
        """List the tasks, baselines first."""
        return [
            task
            for case in (RAYS, PATHS)
            for task in self.compared(
                case,
                {mode: partial(self._measure, case, mode) for mode in MODES},
                {"dies_at": DIES_AT, "threads": 1},
                clock="wall",
                cost_s=90.0,
            )
        ]

    @cached_property
    def _client(self) -> SnapshotClient:
        return SnapshotClient(self._folder / "spool", name="benchmark")

    def _request(self, case: str) -> SnapshotRequest:
        if case == RAYS:
            subject = subjects(self.quick)[0].subject
            size = 384 if self.quick else 512
            camera = subject.views["inside"].camera(size, Projection.PERSPECTIVE)
            return self._client.request_classic(
                subject.scene, camera, quality="reference"
            )
        view = acceptance_views(64 if self.quick else 128)[1]
        surface = nasal_scene(view.head).surface
        if surface is None:
            raise UnavailableError("the view has no air surface")
        return self._client.request_scope(
            surface, view.camera, samples=1, path_tracing=PathTracingSpec(paths=256)
        )

    def _measure(self, case: str, mode: str) -> Measured:
        walls: list[float] = []
        kept = 0
        for _ in range(self._repeats):
            request = self._request(case)
            job = self._client.submit(request)
            if mode != UNDISTURBED:
                self._die(job)
            if mode == ANEW:
                forget_saved(self._client.spool, job)
            began = time.perf_counter()
            self._work(job)
            walls.append(time.perf_counter() - began)
            snapshot = self._client.wait(job, timeout_s=1)
            kept = snapshot.result.counters.get("rays_kept", 0)
        radiance = snapshot.radiance()
        whole = self._whole.setdefault(case, radiance)
        return Measured(
            Timing.of(walls, walls),
            image_error(radiance, whole),
            UNIT,
            {"rays_kept": float(kept)},
        )

    def _die(self, job: str) -> None:
        """Leave a job at the share where its worker dies."""
        spool = self._client.spool
        run_worker(
            spool.folder,
            threads=1,
            save_every_s=self._every_s,
            stopped=lambda: (
                spool.status(job).done >= DIES_AT or spool.status(job).state.is_final
            ),
        )
        if spool.status(job).state.is_final:
            raise UnavailableError("the picture was finished before its worker died")

    def _work(self, job: str) -> None:
        run_worker(
            self._client.spool.folder,
            once=True,
            threads=1,
            lease_s=LEASE_S,
            save_every_s=self._every_s,
        )
