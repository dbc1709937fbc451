"""The status of a job while it is worked on, and what may end it early."""

import threading
import time
from contextlib import AbstractContextManager

from renderers.art.job_steps import Step, reached
from renderers.snapshots.spool import JobState, JobStatus, Spool

HEARTBEAT_S = 2.0

LOOK_S = 0.05
"""Time between two looks for a client's wish to cancel."""

Verdict = tuple[JobState, str]


class Heartbeat(AbstractContextManager["Heartbeat"]):
    """Renew a job's status; end it when its client or its time says so.

    A thread, because loading, compiling and shading can each take longer than a lease.
    A job that is cancelled or late is said to have ended at once, whatever the worker
    is in the middle of; the worker stops when it next asks `may_go_on`.
    """

    def __init__(self, spool: Spool, job_id: str, attempt: int) -> None:
        self.done = 0.0
        """Share of the picture, for the next status."""
        self._spool = spool
        self._job_id = job_id
        self._attempt = attempt
        self._beats = 0
        self._limits: list[tuple[float, str]] = []
        self._is_lost = False
        self._said: JobState | None = None
        self._lock = threading.Lock()
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._watch, daemon=True)

    def __enter__(self) -> "Heartbeat":
        self._thread.start()
        return self

    def __exit__(self, *error: object) -> None:
        self._over.set()
        self._thread.join()

    def limit(self, seconds: float, reason: str) -> None:
        """Let the job fail for a reason so many seconds from now."""
        self._limits.append((time.monotonic() + seconds, reason))

    @property
    def is_over(self) -> bool:
        """Return whether the final status was written here."""
        return self._said is not None

    def may_go_on(self) -> bool:
        """Return whether the job is still wanted, and still ours."""
        return self._said is None and not self._is_lost

    def look(self) -> bool:
        """See whether the job was cancelled or is late; then as `may_go_on`."""
        if self.may_go_on():
            now = time.monotonic()
            late = [reason for at, reason in self._limits if now >= at]
            if self._spool.is_cancelled(self._job_id):
                self.end(JobState.CANCELLED, "cancelled by its client")
            elif late:
                self.end(JobState.FAILED, late[0])
        return self.may_go_on()

    def end(self, state: JobState, message: str = "") -> None:
        """Write the final status, unless it stands or another worker has the job."""
        with self._lock:
            self._is_lost |= not self._spool.owns(self._job_id, self._attempt)
            if self.may_go_on():
                self._say(state, message)
                self._said = state
                reached(Step.JOB_ENDED)

    def _say(self, state: JobState, message: str = "") -> None:
        self._beats += 1
        status = JobStatus(state, self._attempt, self._beats, self.done, message)
        self._spool.set_status(self._job_id, status)

    def _watch(self) -> None:
        last, shown = 0.0, -1.0
        while not self._over.wait(LOOK_S):
            try:
                if not self.look():
                    return
                now = time.monotonic()
                if now - last > HEARTBEAT_S or self.done != shown:
                    last, shown = now, self.done
                    self._beat()
            except OSError:
                # The disk refuses for now. The lease runs out if it goes on to.
                continue

    def _beat(self) -> None:
        with self._lock:
            # This process may have been held up so long that another took the job.
            self._is_lost |= not self._spool.owns(self._job_id, self._attempt)
            if self.may_go_on():
                self._say(JobState.RUNNING)
