"""One ray tracer for several pictures: a worker of one's own, or those of a spool."""

import math
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path

from paravol.patient import Progress
from paravol.snapshots.head_scene import HeadScene, RenderSettings
from paravol.snapshots.outputs import RenderedPicture
from paravol.snapshots.rendering_service import running_worker
from paravol.snapshots.spool_folder import own_spool
from paravol.snapshots.view_file import ViewFile
from renderers.snapshots.client import (
    Snapshot,
    SnapshotClient,
)
from renderers.snapshots.spool import JobState

PATIENCE_S = 60.0
"""How long the best picture so far is waited for after Ctrl-C."""

SAY_AFTER_S = 3.0
"""Waiting time after which a request that no worker has taken is reported."""

Say = Callable[[str], None]


class ServedSpool:
    """Wait for pictures of a spool folder, and say when no worker draws them."""

    def __init__(self, client: SnapshotClient, say: Say) -> None:
        self._client = client
        self._say = say
        self._said: set[str] = set()

    def wait(
        self, job: str, progress: Callable[[float], None], timeout_s: float | None
    ) -> Snapshot:
        """Wait until a job has ended, whoever draws it; see `SnapshotClient.wait`."""
        began = time.monotonic()
        spool = self._client.spool

        def watch() -> None:
            waited = time.monotonic() - began
            queued = spool.status(job).state is JobState.QUEUED
            if queued and waited > SAY_AFTER_S:
                self._once(
                    f"No worker has taken the request yet. To serve it: paravol worker "
                    f"--spool {spool.folder}. Ctrl-C takes the request back."
                )
            if lost := self._client.lost(job):
                self._once(f"{lost} Waiting for one.")

        patience_s = math.inf if timeout_s is None else timeout_s
        return self._client.wait(job, progress, patience_s, watch)

    def take_back(self, job: str) -> bool:
        """Cancel a job that no worker has begun; return False if one has."""
        if self._client.spool.status(job).state is not JobState.QUEUED:
            return False
        self._client.cancel(job)
        return True

    def _once(self, sentence: str) -> None:
        if sentence not in self._said:
            self._said.add(sentence)
            self._say(sentence)


class RenderSession:
    """Draw views of a head one after the other.

    The first Ctrl-C asks for the best picture so far, a second one gives up.
    interrupted: whether there was a first Ctrl-C. wait: as `SnapshotClient.wait`.
    take_back: cancels a job that has not begun; returns whether it did.
    """

    def __init__(
        self,
        head: HeadScene,
        client: SnapshotClient,
        progress: Progress,
        say: Say,
        wait: Callable[[str, Callable[[float], None], float | None], Snapshot],
        take_back: Callable[[str], bool],
    ) -> None:
        self.interrupted = False
        self.client = client
        self.head = head
        self.progress, self.say = progress, say
        self._wait, self._take_back = wait, take_back

    def draw(
        self, view: ViewFile, settings: RenderSettings, stage: str
    ) -> tuple[RenderedPicture, Snapshot]:
        """Draw a view; return its picture, and the finished job with its files."""
        show = partial(self.progress, stage)
        show(0.0)
        job = self.client.submit(self.head.request(self.client, view, settings))
        try:
            snapshot = self._wait(job, show, None)
        except KeyboardInterrupt:
            if self._take_back(job):
                raise
            self.interrupted = True
            self.say(
                "Stopping: taking the best picture so far. Ctrl-C again leaves none."
            )
            self.client.finish(job)
            try:
                snapshot = self._wait(job, show, PATIENCE_S)
            except BaseException:
                # others' workers must not draw on for nobody
                self.client.cancel(job)
                raise
        return RenderedPicture.of(view, snapshot), snapshot


@contextmanager
def render_session(
    head: HeadScene,
    progress: Progress,
    say: Say,
    *,
    ranks: int = 1,
    spool: Path | None = None,
) -> Iterator[RenderSession]:
    """Open a session that draws views of a head while the context lasts.

    say: told a sentence when there is something to know. spool: the folder whose
    workers draw; None starts a worker of its own, with so many ranks.
    """
    name = "paravol snapshot"
    if spool is not None:
        client = SnapshotClient(spool, name=name)
        served = ServedSpool(client, say)
        yield RenderSession(head, client, progress, say, served.wait, served.take_back)
        return
    with own_spool() as folder:
        client = SnapshotClient(folder, name=name)
        with running_worker(folder, ranks=ranks) as worker:
            wait = partial(client.wait, watch=worker.ensure_alive)
            yield RenderSession(head, client, progress, say, wait, lambda _: False)
