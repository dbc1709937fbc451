"""One ray tracer for several pictures, which may be told that it is enough."""

import tempfile
from contextlib import ExitStack
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
        with ExitStack() as stack:
            # What a worker still writes when it is ended does not matter any more.
            folder = Path(
                stack.enter_context(
                    tempfile.TemporaryDirectory(
                        prefix="paravol-spool-", ignore_cleanup_errors=True
                    )
                )
            )
            self.client = SnapshotClient(folder, name="paravol snapshot")
            self._worker = stack.enter_context(
                running_worker(folder, ranks=self._ranks)
            )
            self._stack = stack.pop_all()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._stack.__exit__(kind, error, trace)
