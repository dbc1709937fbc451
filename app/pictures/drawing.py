"""One ray tracer for several pictures, which may be told that it is enough."""

import shutil
import tempfile
from pathlib import Path
from types import TracebackType
from typing import Self

from app.pictures.outputs import Drawn
from app.pictures.studio import Fineness, Studio
from app.pictures.view_file import ViewFile
from app.rendering_service import running_worker
from app.terminal import Stages
from renderers.art.client import Snapshot, SnapshotClient

PATIENCE_S = 60.0
"""How long the best picture so far is waited for after Ctrl-C."""


class Drawing:
    """Draw views one after the other; a context manager.

    The first Ctrl-C asks for the best picture so far, a second one gives up.
    interrupted: whether there was a first one.
    """

    def __init__(self, studio: Studio, ranks: int, stages: Stages) -> None:
        self.interrupted = False
        self.client: SnapshotClient
        self._studio = studio
        self._ranks = ranks
        self._stages = stages

    def draw(
        self, view: ViewFile, fineness: Fineness, stage: str
    ) -> tuple[Drawn, Snapshot]:
        """Draw a view; give it, and the finished job for what else it holds."""
        self._stages(stage, 0.0)
        job = self.client.submit(self._studio.request(self.client, view, fineness))

        def show(share: float) -> None:
            self._stages(stage, share)

        alive = self._worker.ensure_alive
        try:
            snapshot = self.client.wait(job, show, watch=alive)
        except KeyboardInterrupt:
            self.interrupted = True
            self._stages.say(
                "Stopping: taking the best picture so far. Ctrl-C again leaves none."
            )
            self.client.finish(job)
            snapshot = self.client.wait(job, show, PATIENCE_S, watch=alive)
        return Drawn.of(view, snapshot), snapshot

    def __enter__(self) -> Self:
        self._folder = Path(tempfile.mkdtemp(prefix="paravol-spool-"))
        try:
            self.client = SnapshotClient(self._folder, name="paravol snapshot")
            self._running = running_worker(self._folder, ranks=self._ranks)
            self._worker = self._running.__enter__()
        except BaseException:
            shutil.rmtree(self._folder, ignore_errors=True)
            raise
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        try:
            self._running.__exit__(kind, error, trace)
        finally:
            shutil.rmtree(self._folder, ignore_errors=True)
