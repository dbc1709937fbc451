"""The worker: takes requests from a spool folder, draws them, one after the other."""

import sys
import threading
import time
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from pathlib import Path

import msgspec

from renderers.art.job_steps import Step, reached
from renderers.art.ranks.transport import RankRefusedError, TransportError
from renderers.art.tracer import RenderStoppedError
from renderers.scene import Scene
from renderers.snapshots.data_store import write_whole
from renderers.snapshots.delivery import (
    Attempt,
    Finisher,
    path_tracing_of,
    write_picture,
)
from renderers.snapshots.growing import show
from renderers.snapshots.lease import LEASE_S
from renderers.snapshots.pruning import KEEP_S, Pruner
from renderers.snapshots.refinement import (
    Preview,
    Refinement,
    can_refine,
    stopped_picture,
    trace_best,
)
from renderers.snapshots.request import (
    RESULT_SCHEMA,
    SnapshotRequest,
    SnapshotResult,
    decode_request,
)
from renderers.snapshots.result_cache import CACHE_BYTES, ResultCache
from renderers.snapshots.saved_work import SavedWork, code_key, forget_saved
from renderers.snapshots.scene_loader import camera_in_tissue, load_scene, load_tools
from renderers.snapshots.spool import (
    SAVE_EVERY_S,
    Claim,
    JobState,
    JobStatus,
    Spool,
    SpoolError,
)
from renderers.snapshots.team import SerialTeam, Team, Traced
from system import UserError

POLL_S = 0.05

REFUSED_S = 1.0
"""Between two tries while the disk refuses."""

MOST_ATTEMPTS = 3

HEARTBEAT_S = 2.0

UNMOVED_S = 600.0
"""For what comes before a job's first rays: loading, and compiling on a new machine."""

LOOK_S = 0.05
"""Time between two looks for a client's wish to cancel."""

Verdict = tuple[JobState, str]


def _never() -> bool:
    return False


def run_worker(
    folder: Path,
    *,
    once: bool = False,
    team: Team | None = None,
    threads: int = 2,
    lease_s: float = LEASE_S,
    keep_s: float = KEEP_S,
    save_every_s: float = SAVE_EVERY_S,
    cache_bytes: int = CACHE_BYTES,
    stopped: Callable[[], bool] = _never,
) -> int:
    """Serve a spool folder; return the number of jobs that reached an end.

    once: stop when nothing is left that no living worker does; a job whose worker gave
    no sign of life within the lease is drawn before. team: those who trace; None for
    the threads of this process. keep_s: how long finished jobs stay in the folder.
    save_every_s: how often what is found is saved, for whoever takes the job over.
    cache_bytes: room for pictures, and again for what rays found, that the same view is
    not drawn again from; 0 draws every job.
    stopped: asked between bands; a job that is then going on is left to the next
    worker. Raise SpoolError when the folder cannot be used.
    """
    spool = Spool(folder)
    pruner = Pruner(spool, keep_s)
    team = team or SerialTeam(threads)
    finisher = Finisher(spool.data, threads)
    code_key()
    cache = ResultCache(cache_bytes)
    worker = _Worker(spool, team, finisher, cache, save_every_s, stopped)
    served, is_refused = 0, False
    try:
        while not stopped():
            try:
                claim = spool.claim() or spool.take_over(lease_s)
                if claim is None:
                    pruner.prune_at_times()
                else:
                    served += worker.serve(claim)
                if is_refused:
                    is_refused = False
                    _say(f"Spool {folder} is served again.")
                if claim is not None:
                    continue
                if once and spool.is_quiet():
                    break
            except OSError as error:
                # The disk is full, or may not be written for a while: outlast that. A
                # job that was being drawn is taken over when its lease has run out.
                if not spool.queue.is_dir():
                    raise SpoolError(
                        f"Spool {folder} is not there any more."
                    ) from error
                if not is_refused:
                    is_refused = True
                    said = error.strerror or error
                    _say(
                        f"Spool {folder} cannot be used: {said}; it is tried again and "
                        "again."
                    )
            time.sleep(REFUSED_S if is_refused else POLL_S)
    finally:
        finisher.close()
        team.dismiss()
    return served


def _say(sentence: str) -> None:
    print(sentence, file=sys.stderr, flush=True)


class Heartbeat(AbstractContextManager["Heartbeat"]):
    """Renew a job's status; end it when its client or its time says so.

    A thread, because loading, compiling and shading can each take longer than a lease.
    A job that is cancelled or late is said to have ended at once, whatever the worker
    is in the middle of; the worker stops when it next asks `may_go_on`.
    """

    def __init__(self, spool: Spool, job_id: str, attempt: int) -> None:
        self.done = 0.0
        """Share of the picture, for the next status."""
        self.is_over = False
        """Whether the final status was written here."""
        self._spool = spool
        self._job_id = job_id
        self._attempt = attempt
        self._beats = 0
        self._limits: list[tuple[float, str]] = []
        self._is_lost = False
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

    def may_go_on(self) -> bool:
        """Return whether the job is still wanted, and still ours."""
        return not (self.is_over or self._is_lost)

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
        if self._say(state, message):
            reached(Step.JOB_ENDED)

    def _say(self, state: JobState, message: str = "") -> bool:
        """Write a status; return whether the job is still ours to speak of."""
        with self._lock:
            # This process may have been held up so long that another took the job.
            self._is_lost |= not self._spool.owns(self._job_id, self._attempt)
            if not self.may_go_on():
                return False
            self._beats += 1
            status = JobStatus(state, self._attempt, self._beats, self.done, message)
            self._spool.set_status(self._job_id, status)
            self.is_over = state.is_final
            return True

    def _watch(self) -> None:
        last, shown = 0.0, -1.0
        while not self._over.wait(LOOK_S):
            try:
                if not self.look():
                    return
                now = time.monotonic()
                if now - last > HEARTBEAT_S or self.done != shown:
                    last, shown = now, self.done
                    self._say(JobState.RUNNING)
            except OSError:
                # The disk refuses for now. The lease runs out if it goes on to.
                continue


@dataclass(frozen=True, slots=True)
class _Worker:
    """Bring one job after the other to an end; fields as in `run_worker`."""

    spool: Spool
    team: Team
    finisher: Finisher
    cache: ResultCache
    save_every_s: float
    stopped: Callable[[], bool]

    def serve(self, claim: Claim) -> bool:
        """Draw one job; False when the worker was stopped before it ended.

        What is wrong with the job becomes its status, never the worker's end.
        """
        with Heartbeat(self.spool, claim.job_id, claim.attempt) as heart:
            try:
                verdict = self._judge(claim, heart)
            except TransportError:
                # The other ranks are gone; the job is left to the next worker.
                raise
            except Exception as error:
                # A fault of ours. The client is told now rather than by our silence.
                fault = f"the worker broke: {type(error).__name__}: {error}"
                heart.end(JobState.FAILED, fault[:2000])
                raise
            if verdict is not None:
                heart.end(*verdict)
            if self.spool.status(claim.job_id).state.is_final:
                forget_saved(self.spool, claim.job_id)
            return heart.is_over

    def _judge(self, claim: Claim, heart: Heartbeat) -> Verdict | None:
        """Draw a job and tell how it ends; None when that was said or is left open."""
        if claim.attempt > MOST_ATTEMPTS:
            return JobState.FAILED, f"{MOST_ATTEMPTS} workers died drawing it"
        try:
            request = decode_request(claim.record)
            if request.id != claim.job_id:
                raise UserError(f"id: the request says it is {request.id}")
            self._render(request, claim.attempt, heart)
        except RenderStoppedError:
            # Cancelled or late, or this worker was stopped from outside: then the next
            # one takes the job over.
            return None
        except ValueError as error:
            return JobState.REJECTED, str(error)
        except (OSError, MemoryError, RankRefusedError) as error:
            return JobState.FAILED, str(error) or type(error).__name__
        return JobState.DONE, ""

    def _render(self, request: SnapshotRequest, number: int, heart: Heartbeat) -> None:
        began = time.perf_counter()
        moved: float | None = None
        heart.limit(
            request.max_seconds + UNMOVED_S,
            f"the picture took longer than max_seconds, {request.max_seconds:g} s, and "
            f"{UNMOVED_S:g} s of preparation",
        )
        if request.deadline_s is not None:
            heart.limit(
                request.deadline_s - self.spool.age_s(request.id),
                f"the picture was not done within deadline_s, {request.deadline_s:g} s",
            )
        if not heart.look():
            raise RenderStoppedError()

        def go_on(share: float) -> bool:
            nonlocal moved
            if moved is None and share > 0.0:
                moved = time.perf_counter()
            heart.done = max(heart.done, 0.99 * share)
            return heart.may_go_on() and not self.stopped()

        def enough() -> bool:
            after, now = request.deliver_after_s, time.perf_counter()
            late = after is not None and now - began > after
            late |= moved is not None and now - moved > request.max_seconds
            return late or self.spool.is_enough(request.id)

        scene = load_scene(self.spool.data, request)
        reached(Step.SCENE_LOADED)
        loaded = time.perf_counter()
        folder = self.spool.attempt_folder(request.id, number)
        saved = SavedWork(self.spool, request, number, self.save_every_s)
        attempt = Attempt(go_on, enough, saved)
        picture, traced = self.cache.picture(request), self.cache.traced(request)
        skipped = {
            "views_skipped": int(picture is not None),
            "traces_skipped": int(picture is not None or traced is not None),
        }
        counters: dict[str, int] = {}
        share = 1.0
        if picture is None and can_refine(request):
            refinement = Refinement(self.team, self.finisher, request, scene, go_on)
            if request.progressive:
                show(folder, refinement.picture().pixels)
            picture = refinement.run(enough)
            counters = dict(refinement.counters)
            share = float(picture.samples.mean()) / 4
            self.cache.keep_picture(request, picture)
        elif picture is None and traced is None:
            traced = self._trace(request, scene, folder, attempt)
            self.cache.keep_traced(request, traced)
            counters = traced.counters
            share = 1.0 if traced.drawn is None else float(traced.drawn.mean())
        found = time.perf_counter()
        if picture is None:
            assert traced is not None
            picture = self.finisher.finish(request, scene, traced, attempt)
            picture = stopped_picture(request, traced, picture)
            self.cache.keep_picture(request, picture)
        reached(Step.PICTURE_SHADED)
        shaded = time.perf_counter()
        if not (heart.look() and go_on(1.0)):
            raise RenderStoppedError()
        digests = write_picture(folder, request, picture)
        reached(Step.PICTURE_WRITTEN)
        result = SnapshotResult(
            schema=RESULT_SCHEMA,
            id=request.id,
            mode="classic" if picture.gain is None else "scope",
            width=request.image.width,
            height=request.image.height,
            ranks=self.team.ranks,
            attempt=number,
            gain=picture.gain,
            complete=picture.complete,
            traced=share,
            noise=picture.noise,
            error=picture.error,
            seconds={
                "load": loaded - began,
                "trace": found - loaded,
                "shade": shaded - found,
                "total": time.perf_counter() - began,
            },
            counters=counters | skipped,
            digests=digests,
            camera_in_tissue=camera_in_tissue(request, scene),
            step_voxels=None if traced is None else traced.step_voxels,
        )
        write_whole(folder / "result.json", msgspec.json.encode(result))
        reached(Step.RESULT_WRITTEN)
        heart.done = 1.0

    def _trace(
        self, request: SnapshotRequest, scene: Scene, folder: Path, attempt: Attempt
    ) -> Traced:
        """Trace a view; show it while it comes."""
        # where light is followed by paths, that takes nearly all the time
        tracing = 0.05 if path_tracing_of(request) else 0.9
        return trace_best(
            self.team,
            request,
            scene,
            replace(attempt, go_on=lambda share: attempt.go_on(tracing * share)),
            Preview(folder, request, scene, self.finisher),
            load_tools(self.spool.data, request),
        )
