"""Waiting for workers that others run."""

import time
from collections.abc import Callable

from renderers.snapshots.client import (
    Snapshot,
    SnapshotClient,
    SnapshotError,
    WorkerLostError,
)
from renderers.snapshots.spool import JobState

SAY_AFTER_S = 3.0
"""A request that nobody has taken for so long is told of."""

LOOK_S = 0.5


class ServedSpool:
    """Wait for pictures of a spool folder, and tell when nobody draws them.

    say: told a sentence when there is something to know.
    """

    def __init__(self, client: SnapshotClient, say: Callable[[str], None]) -> None:
        self._client = client
        self._say = say
        self._told: set[str] = set()

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

        while True:
            left = timeout_s and max(timeout_s - (time.monotonic() - began), 0.0)
            try:
                return self._client.wait(job, progress, left, watch)
            except WorkerLostError as error:
                if timeout_s is not None and not left:
                    raise SnapshotError(str(error)) from error
                self._once(f"{error} Waiting for one.")
                time.sleep(LOOK_S)

    def take_back(self, job: str) -> bool:
        """Cancel a job that nobody has begun; False when somebody has."""
        if self._client.spool.status(job).state is not JobState.QUEUED:
            return False
        self._client.cancel(job)
        return True

    def _once(self, sentence: str) -> None:
        if sentence not in self._told:
            self._told.add(sentence)
            self._say(sentence)
