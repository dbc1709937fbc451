"""One ray tracer for several pictures, which may be told that it is enough."""

from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import Self

from app.cli.served_spool import ServedSpool
from app.cli.terminal import Stages
from paravol.snapshots.outputs import Drawn
from paravol.snapshots.rendering_service import running_worker
from paravol.snapshots.spool_folder import own_spool
from paravol.snapshots.studio import Fineness, Studio
from paravol.snapshots.view_file import ViewFile
from renderers.snapshots.client import Snapshot, SnapshotClient

PATIENCE_S = 60.0
"""How long the best picture so far is waited for after Ctrl-C."""


class Drawing:
    """Draw views one after the other; a context manager.

    The first Ctrl-C asks for the best picture so far, a second one gives up. spool: the
    folder whose workers draw; None starts a worker of its own, with so many ranks.
    interrupted: whether there was a first Ctrl-C.
    """

    def __init__(
        self, studio: Studio, ranks: int, stages: Stages, spool: Path | None = None
    ) -> None:
        self.interrupted = False
        self.client: SnapshotClient
        self._studio = studio
        self._ranks = ranks
        self._stages = stages
        self._spool = spool

    def draw(
        self, view: ViewFile, fineness: Fineness, stage: str
    ) -> tuple[Drawn, Snapshot]:
        """Draw a view; give it, and the finished job for what else it holds."""
        self._stages(stage, 0.0)
        job = self.client.submit(self._studio.request(self.client, view, fineness))

        def show(share: float) -> None:
            self._stages(stage, share)

        try:
            snapshot = self._wait(job, show, None)
        except KeyboardInterrupt:
            if self._served is not None and self._served.take_back(job):
                raise
            self.interrupted = True
            self._stages.say(
                "Stopping: taking the best picture so far. Ctrl-C again leaves none."
            )
            self.client.finish(job)
            try:
                snapshot = self._wait(job, show, PATIENCE_S)
            except BaseException:
                # others' workers are not to draw on for nobody
                self.client.cancel(job)
                raise
        return Drawn.of(view, snapshot), snapshot

    def _wait(
        self, job: str, show: Callable[[float], None], timeout_s: float | None
    ) -> Snapshot:
        if self._served is not None:
            return self._served.wait(job, show, timeout_s)
        alive = self._worker.ensure_alive
        return self.client.wait(job, show, timeout_s, watch=alive)

    def __enter__(self) -> Self:
        self._served: ServedSpool | None = None
        with ExitStack() as stack:
            name = "paravol snapshot"
            if self._spool is None:
                folder = stack.enter_context(own_spool())
                self.client = SnapshotClient(folder, name=name)
                self._worker = stack.enter_context(
                    running_worker(folder, ranks=self._ranks)
                )
            else:
                self.client = SnapshotClient(self._spool, name=name)
                self._served = ServedSpool(self.client, self._stages.say)
            self._stack = stack.pop_all()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._stack.__exit__(kind, error, trace)
