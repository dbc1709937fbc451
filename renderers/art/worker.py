"""The worker: takes requests from a spool folder, draws them, one after the other."""

import threading
import time
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path
from types import TracebackType

import msgspec

from renderers.art.delivery import Finisher, write_picture
from renderers.art.files import write_whole
from renderers.art.job import (
    RESULT_SCHEMA,
    SnapshotRequest,
    SnapshotResult,
    decode_request,
)
from renderers.art.progressive import trace_best
from renderers.art.spool import LEASE_S, JobState, JobStatus, Spool
from renderers.art.stage import load_scene
from renderers.art.team import SerialTeam, Team
from renderers.art.tracer import RenderStoppedError
from renderers.art.transport import RankRefusedError, TransportError
from renderers.art.truth import truth_of

POLL_S = 0.05
HEARTBEAT_S = 2.0
MOST_ATTEMPTS = 3


def _never() -> bool:
    return False


def run_worker(
    folder: Path,
    *,
    once: bool = False,
    team: Team | None = None,
    threads: int = 2,
    lease_s: float = LEASE_S,
    stopped: Callable[[], bool] = _never,
) -> int:
    """Serve a spool folder; return the number of jobs that reached an end.

    once: stop when the queue is empty. team: those who trace; None for the threads
    of this process. stopped: asked between bands; a job that is then going on is left
    to the next worker. Raise SpoolError when the folder cannot be used.
    """
    spool = Spool(folder)
    team = team or SerialTeam(threads)
    worker = _Worker(spool, team, Finisher(spool.data, threads), stopped)
    served = 0
    try:
        while not stopped():
            claimed = spool.claim()
            if claimed is not None:
                served += worker.serve(*claimed, attempt=1)
                continue
            taken = spool.take_over(lease_s)
            if taken is not None:
                served += worker.serve(taken[0], taken[1], attempt=taken[2])
            elif once:
                break
            else:
                time.sleep(POLL_S)
    finally:
        worker.finisher.close()
        team.dismiss()
    return served


class _Heartbeat(AbstractContextManager["_Heartbeat"]):
    """Renew a job's status while it is worked on.

    A thread, because loading, compiling and shading can each take longer than a lease.
    """

    def __init__(self, spool: Spool, job_id: str, attempt: int) -> None:
        self.done = 0.0
        self._spool = spool
        self._job_id = job_id
        self._attempt = attempt
        self._beats = 0
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._beat, daemon=True)
        self._shown = 0.0

    def __enter__(self) -> "_Heartbeat":
        self._thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._over.set()
        self._thread.join()

    def status(self, state: JobState, message: str = "") -> JobStatus:
        """Make the next status."""
        self._beats += 1
        return JobStatus(state, self._attempt, self._beats, self.done, message)

    def _beat(self) -> None:
        last = 0.0
        while not self._over.wait(0.1):
            now = time.monotonic()
            if not self._spool.owns(self._job_id, self._attempt):
                # This process was held up so long that another took the job over.
                return
            if now - last > HEARTBEAT_S or self.done != self._shown:
                last, self._shown = now, self.done
                self._spool.set_status(self._job_id, self.status(JobState.RUNNING))


class _LimitError(RuntimeError):
    """A job took longer than its request allows."""


class _Worker:
    """Bring one job after the other to an end."""

    def __init__(
        self,
        spool: Spool,
        team: Team,
        finisher: Finisher,
        stopped: Callable[[], bool],
    ) -> None:
        self.finisher = finisher
        self._spool = spool
        self._team = team
        self._stopped = stopped

    def serve(self, job_id: str, record: bytes, attempt: int) -> bool:
        """Draw one job; False when the worker was stopped before it ended.

        What is wrong with the job becomes its status, never the worker's end.
        """
        with _Heartbeat(self._spool, job_id, attempt) as heart:
            try:
                state, message = self._draw(job_id, record, attempt, heart)
            except TransportError:
                # The other ranks are gone; the job is left to the next worker.
                raise
            except Exception as error:
                # A fault of ours. The client is told now rather than by our silence.
                fault = f"the worker broke: {type(error).__name__}: {error}"
                status = heart.status(JobState.FAILED, fault[:2000])
                self._spool.set_status(job_id, status)
                raise
        if state is JobState.RUNNING or not self._spool.owns(job_id, attempt):
            return False
        self._spool.set_status(job_id, heart.status(state, message))
        return True

    def _draw(
        self, job_id: str, record: bytes, attempt: int, heart: _Heartbeat
    ) -> tuple[JobState, str]:
        if attempt > MOST_ATTEMPTS:
            return JobState.FAILED, f"{MOST_ATTEMPTS} workers died drawing it"
        try:
            request = decode_request(record)
            if request.id != job_id:
                raise ValueError(f"the request's id is {request.id} - at `$.id`")
        except ValueError as error:
            return JobState.REJECTED, str(error)
        try:
            self._render(request, attempt, heart)
        except RenderStoppedError:
            if self._spool.is_cancelled(job_id):
                return JobState.CANCELLED, "cancelled by its client"
            # Stopped from outside: the next worker takes the job over.
            return JobState.RUNNING, ""
        except ValueError as error:
            return JobState.REJECTED, str(error)
        except (OSError, MemoryError, RankRefusedError, _LimitError) as error:
            return JobState.FAILED, str(error) or type(error).__name__
        return JobState.DONE, ""

    def _render(
        self, request: SnapshotRequest, attempt: int, heart: _Heartbeat
    ) -> None:
        began = time.perf_counter()

        def go_on(share: float) -> bool:
            heart.done = max(heart.done, 0.99 * share)
            if time.perf_counter() - began > request.max_seconds:
                raise _LimitError(
                    f"the picture took longer than max_seconds, {request.max_seconds} s"
                )
            return not (self._stopped() or self._spool.is_cancelled(request.id))

        def enough() -> bool:
            after = request.deliver_after_s
            late = after is not None and time.perf_counter() - began > after
            return late or self._spool.is_enough(request.id)

        if not go_on(0.0):
            raise RenderStoppedError()
        scene = load_scene(self._spool.data, request)
        loaded = time.perf_counter()
        # where light is followed by paths, that takes nearly all the time
        tracing = 0.05 if truth_of(request) else 0.9
        traced = trace_best(
            self._team, request, scene, lambda share: go_on(tracing * share), enough
        )
        found = time.perf_counter()
        picture = self.finisher.finish(request, scene, traced, go_on, enough)
        shaded = time.perf_counter()
        if not go_on(1.0):
            raise RenderStoppedError()
        folder = self._spool.job_folder(request.id)
        digests = write_picture(folder, request, picture)
        result = SnapshotResult(
            schema=RESULT_SCHEMA,
            id=request.id,
            mode="classic" if picture.gain is None else "scope",
            width=request.image.width,
            height=request.image.height,
            ranks=self._team.ranks,
            attempt=attempt,
            gain=picture.gain,
            complete=picture.complete,
            traced=1.0 if traced.drawn is None else float(traced.drawn.mean()),
            noise=picture.noise,
            seconds={
                "load": loaded - began,
                "trace": found - loaded,
                "shade": shaded - found,
                "total": time.perf_counter() - began,
            },
            counters=traced.counters,
            digests=digests,
        )
        write_whole(folder / "result.json", msgspec.json.encode(result))
        heart.done = 1.0
