"""Snapshot jobs: what the spool adds, the first sight of a picture, cancelling."""

import tempfile
import threading
import time
from collections.abc import Callable
from functools import cached_property, partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.plan import Measured, Plan, Task, UnavailableError
from benchmarks.scenes import subjects
from benchmarks.schema import Setting
from benchmarks.timing import Timing, measure
from renderers.art.job_steps import Step, reached
from renderers.scene import Camera, Image, Projection, image_error
from renderers.snapshots.client import SnapshotCancelledError, SnapshotClient
from renderers.snapshots.growing import GrowingPicture
from renderers.snapshots.request import QualityName, SnapshotRequest
from renderers.snapshots.team import SerialTeam
from renderers.snapshots.worker import run_worker

UNIT = "8-bit codes"
PATIENCE_S = 120.0
ALONE = "team alone"
"""The rays of a picture, without spool, files or preview."""

CANCELLED: tuple[QualityName, ...] = ("snapshot", "reference")

CANCEL_AFTER = 2
"""Slices of rays before the client cancels: it is in the middle of the picture."""

CANCEL_SIZE = 2048
"""Pixels a side of a picture to cancel: it takes many slices of 40 ms."""


class JobsPlan(Plan, suite="jobs"):
    """List and make the measurements of suite `jobs`."""

    def __init__(self, quick: bool) -> None:
        super().__init__(quick)
        self._size = 192 if quick else 512
        self._budget_s = 1.0 if quick else 6.0
        self._source = subjects(quick)[0]
        self._team = SerialTeam(1)

    def tasks(self) -> list[Task]:
        """List the tasks; the plain picture is each case's baseline."""
        case, settings = "classic picture", self._settings(self._size)
        runs: dict[str, Callable[[], Measured]] = {
            "job": partial(self._job, False),
            "job shown as it grows": partial(self._job, True),
            "first sight of it": self._first_sight,
        }
        task = partial(self.task, clock="wall", cost_s=20.0)
        compared = settings | {"reference": ALONE}
        found = [task(case, ALONE, self._alone, settings)]
        found += [task(case, mode, run, compared, ALONE) for mode, run in runs.items()]
        return found + [
            task(
                f"cancel, {quality}",
                "client is told" if is_told else "worker is free",
                partial(self._cancel, quality, is_told),
                self._settings(CANCEL_SIZE),
            )
            for quality in CANCELLED
            for is_told in (True, False)
        ]

    @staticmethod
    def _settings(size: int) -> dict[str, Setting]:
        return {"size": size, "threads": 1}

    @cached_property
    def _client(self) -> SnapshotClient:
        """Serve a spool from a thread of this process, whose kernels are compiled."""
        scratch = tempfile.TemporaryDirectory(prefix="paravol-jobs-")
        folder = Path(self.stack.enter_context(scratch)) / "spool"
        client, stop = SnapshotClient(folder, name="benchmark"), threading.Event()
        # a view is asked for again and again, and always to be drawn
        told = {"stopped": stop.is_set, "threads": 1, "cache_bytes": 0}
        worker = threading.Thread(target=run_worker, args=(folder,), kwargs=told)
        self.stack.callback(worker.join, PATIENCE_S)
        self.stack.callback(stop.set)
        worker.start()
        return client

    def _request(
        self,
        size: int | None = None,
        *,
        progressive: bool = False,
        quality: QualityName = "snapshot",
    ) -> SnapshotRequest:
        subject = self._source.subject
        camera: Camera = subject.views["inside"].camera(
            size or self._size, Projection.PERSPECTIVE
        )
        return self._client.request_classic(
            subject.scene, camera, quality=quality, progressive=progressive
        )

    def _pixels(self) -> NDArray[np.uint8]:
        request = self._request()
        found = self._team.trace(request, self._source.subject.scene, _go).found
        assert isinstance(found, Image)
        return found.to_srgb8((0.0, 0.0, 0.0))

    def _alone(self) -> Measured:
        request, scene = self._request(), self._source.subject.scene
        timing, _ = measure(
            lambda: self._team.trace(request, scene, _go), budget_s=self._budget_s
        )
        return Measured(timing)

    def _job(self, progressive: bool) -> Measured:
        client = self._client

        def ask() -> NDArray[np.uint8]:
            job = client.submit(self._request(progressive=progressive))
            return client.wait(job, timeout_s=PATIENCE_S).pixels()

        timing, pixels = measure(ask, budget_s=self._budget_s)
        return self._compared(timing, pixels)

    def _first_sight(self) -> Measured:
        """Time from asking to the first coarse picture, and how far off that is."""
        client = self._client

        def look() -> NDArray[np.uint8]:
            request = self._request(progressive=True)
            image = request.image
            growing = GrowingPicture(
                client.spool, request.id, image.width, image.height
            )
            client.submit(request)
            began = time.monotonic()
            while not growing.update():
                if time.monotonic() - began > PATIENCE_S:
                    raise UnavailableError("no coarse picture came")
                time.sleep(0.002)
            return growing.pixels

        walls: list[float] = []
        pixels = look()
        for _ in range(5):
            began = time.perf_counter()
            pixels = look()
            walls.append(time.perf_counter() - began)
            self._rest()
        return self._compared(Timing.of(walls, walls), pixels)

    def _cancel(self, quality: QualityName, is_told: bool) -> Measured:
        """Time from the wish, in the middle of a picture, to its effect."""
        walls = []
        for number in range(6):
            wall = self._cancelled(quality, is_told)
            if number:
                walls.append(wall)
        return Measured(Timing.of(walls, walls))

    def _cancelled(self, quality: QualityName, is_told: bool) -> float:
        client = self._client
        self._rest()
        drawing = threading.Event()
        left = CANCEL_AFTER

        def watch(step: Step) -> None:
            nonlocal left
            if step is Step.RAYS_MOVED:
                left -= 1
                if left <= 0:
                    drawing.set()

        reached.watcher = watch
        try:
            job = client.submit(self._request(CANCEL_SIZE, quality=quality))
            if not drawing.wait(PATIENCE_S):
                raise UnavailableError("the picture was never begun")
        finally:
            reached.watcher = None
        began = time.perf_counter()
        client.cancel(job)
        if is_told:
            try:
                client.wait(job, timeout_s=PATIENCE_S)
            except SnapshotCancelledError:
                return time.perf_counter() - began
            raise UnavailableError("the picture was finished before it was cancelled")
        # The next job is claimed as soon as the worker is free.
        follower = client.submit(self._request())
        while not client.spool.attempt_folder(follower, 1).exists():
            if time.perf_counter() - began > PATIENCE_S:
                raise UnavailableError("the worker never came free")
            time.sleep(0.001)
        free = time.perf_counter() - began
        client.cancel(follower)
        return free

    def _rest(self) -> None:
        """Wait until nothing is being drawn."""
        spool = self._client.spool
        began = time.monotonic()
        while any(
            not spool.status(folder.name).state.is_final
            for folder in spool.jobs.iterdir()
        ) or any(spool.queue.iterdir()):
            if time.monotonic() - began > PATIENCE_S:
                raise UnavailableError("the worker does not come to rest")
            time.sleep(0.01)

    def _compared(self, timing: Timing, pixels: NDArray[np.uint8]) -> Measured:
        self._rest()
        error = image_error(
            pixels.astype(np.float32), self._pixels().astype(np.float32)
        )
        return Measured(timing, error, UNIT)


def _go(_: float) -> bool:
    return True
