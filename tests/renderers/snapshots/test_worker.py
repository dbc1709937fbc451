import errno
import hashlib
import os
import shutil
import threading
import time
from collections.abc import Callable
from pathlib import Path

import msgspec
import numpy as np
import pytest

from renderers.art import ActiveRayTracer
from renderers.art.job_steps import Step, reached
from renderers.art.kernels.march_types import BLOCK_COLUMNS, TILE_PX
from renderers.art.ranks.transport import TransportError
from renderers.art.tracer import FASTER, FIRST_BLOCKS
from renderers.scene import Camera, Scene
from renderers.snapshots import worker
from renderers.snapshots.client import (
    SnapshotCancelledError,
    SnapshotClient,
    SnapshotError,
    WorkerLostError,
)
from renderers.snapshots.request import SnapshotRequest
from renderers.snapshots.spool import Claim, JobState, JobStatus, Spool, SpoolError
from renderers.snapshots.worker import MOST_ATTEMPTS, Heartbeat, run_worker
from tests.renderers.snapshots.bare_requests import blade
from tests.renderers.snapshots.watched_team import WatchedTeam


def test_classic_is_what_the_tracer_draws(
    client: SnapshotClient, scene: Scene, outside: Camera
) -> None:
    shares: list[float] = []
    job = client.submit(client.request_classic(scene, outside, background=(1, 1, 1)))
    assert run_worker(client.spool.folder, once=True) == 1
    snapshot = client.wait(job, shares.append)
    expected = ActiveRayTracer(scene).render(outside)
    assert snapshot.radiance().tobytes() == expected.rgba.tobytes()
    assert expected.depth_mm is not None
    assert snapshot.depth_mm().tobytes() == expected.depth_mm.tobytes()
    assert np.array_equal(snapshot.pixels(), expected.to_srgb8((1, 1, 1)))
    assert shares[-1] == 1
    result = snapshot.result
    assert (result.ranks, result.attempt, result.mode) == (1, 1, "classic")
    assert result.counters["contributing"] > 0
    for name, digest in result.digests.items():
        found = hashlib.sha256((snapshot.folder / name).read_bytes()).hexdigest()
        assert found == digest


def test_the_scope_sees_tissue_and_an_instrument(
    client: SnapshotClient, scene: Scene, inside: Camera
) -> None:
    assert scene.surface is not None
    camera = inside.with_size(48, 40)
    bare = client.request_scope(scene.surface, camera)
    held = client.request_scope(
        scene.surface, camera, gain=0.5, instruments=[blade(camera)]
    )
    for request in (bare, held):
        client.submit(request)
    assert run_worker(client.spool.folder, once=True) == 2
    first, second = client.wait(bare.id), client.wait(held.id)
    assert first.pixels().shape == (40, 48, 3)
    assert first.result.gain is not None
    assert second.result.gain == 0.5
    nearer = second.depth_mm() < first.depth_mm()
    assert 20 < np.count_nonzero(nearer) < 1000
    assert np.all(second.depth_mm()[nearer] < 1.5)
    assert not np.array_equal(first.radiance(), second.radiance())


def test_a_wrong_request_is_rejected_and_the_next_is_served(
    client: SnapshotClient, scene: Scene, outside: Camera
) -> None:
    good = client.request_classic(scene, outside)
    missing = msgspec.structs.replace(
        client.request_classic(scene, outside),
        work=msgspec.structs.replace(good.work, volume="0" * 64),
        priority=1,
    )
    queue = client.spool.folder / "queue"
    (queue / f"0-{1:032x}.json").write_bytes(b'{"pickle": "no"}')
    wrong = msgspec.json.encode(good).replace(b'"quality":"snapshot"', b'"quality":7')
    (queue / f"0-{2:032x}.json").write_bytes(wrong)
    client.submit(missing)
    client.submit(good)
    assert run_worker(client.spool.folder, once=True) == 4
    for job, reason in (
        (f"{1:032x}", "'pickle' is not known"),
        (f"{2:032x}", "quality must be "),
        (missing.id, "there is no data 0000"),
    ):
        with pytest.raises(SnapshotError, match=f"was rejected: .*{reason}"):
            client.wait(job)
    assert client.wait(good.id).picture.exists()


def test_a_job_may_not_take_longer_than_it_said(
    client: SnapshotClient, scene: Scene, outside: Camera
) -> None:
    """The best picture so far is delivered; compiling and loading do not count."""
    large = outside.with_size(900, 800)
    asked = client.request_classic(scene, large, max_seconds=1e-9)
    job, whole = client.submit(asked), client.request_classic(scene, large)
    client.submit(whole)
    run_worker(client.spool.folder, once=True)
    partial = client.wait(job)
    assert not partial.result.complete
    assert 0.0 < partial.result.traced < 1.0
    # and is no answer to who has more time
    assert client.wait(whole.id).result.complete


def test_a_client_that_cancels_need_not_wait_for_a_busy_worker(
    client: SnapshotClient, scene: Scene, outside: Camera
) -> None:
    """The client is told while the worker is in the middle of something long."""
    told: list[JobState] = []

    def wait(request: SnapshotRequest) -> None:
        client.cancel(request.id)
        for _ in range(3000):
            if client.spool.status(request.id).state is not JobState.RUNNING:
                break
            threading.Event().wait(0.01)
        told.append(client.spool.status(request.id).state)

    job = client.submit(client.request_classic(scene, outside))
    assert run_worker(client.spool.folder, once=True, team=WatchedTeam(wait)) == 1
    assert told == [JobState.CANCELLED]
    with pytest.raises(SnapshotCancelledError):
        client.wait(job)


def test_a_cancelled_picture_costs_one_slice_of_rays_more(
    client: SnapshotClient, scene: Scene, outside: Camera
) -> None:
    """Work after the client is told is bounded by a count, not by a time."""
    taken: list[Step] = []
    ended = threading.Event()
    job = client.submit(
        client.request_classic(scene, outside.with_size(1000, 900), quality="preview")
    )

    def watch(step: Step) -> None:
        taken.append(step)
        if step is Step.JOB_ENDED:
            ended.set()
        elif taken.count(Step.RAYS_MOVED) == 2 and step is Step.RAYS_MOVED:
            client.cancel(job)
            assert ended.wait(60), "the client was not told that its job has ended"

    reached.watcher = watch
    try:
        run_worker(client.spool.folder, once=True)
    finally:
        reached.watcher = None
    assert client.spool.status(job).state is JobState.CANCELLED
    assert 2 <= taken.count(Step.RAYS_MOVED) <= 3
    # so many looks would not have been enough for all blocks, on two threads
    drawn = 2 * FIRST_BLOCKS * (1 + FASTER + FASTER**2)
    assert drawn < -(-1000 // BLOCK_COLUMNS) * -(-900 // TILE_PX)


def test_a_deadline_counts_from_when_it_was_asked_for(
    client: SnapshotClient, scene: Scene, outside: Camera
) -> None:
    taken: list[Step] = []
    late = client.request_classic(scene, outside, deadline_s=50)
    early = client.request_classic(scene, outside, deadline_s=200)
    for request in (late, early):
        client.submit(request)
        entry = next(client.spool.queue.glob(f"*{request.id}*"))
        asked = entry.stat().st_mtime - 100
        os.utime(entry, (asked, asked))
    reached.watcher = taken.append
    try:
        assert run_worker(client.spool.folder, once=True) == 2
    finally:
        reached.watcher = None
    with pytest.raises(SnapshotError, match=r"failed: .*within deadline_s, 50"):
        client.wait(late.id)
    assert client.wait(early.id).picture.exists()
    assert taken.count(Step.SCENE_LOADED) == 1, "the late one was not even loaded"


def test_a_stopped_worker_leaves_its_job_to_the_next(
    client: SnapshotClient, scene: Scene, outside: Camera
) -> None:
    job = client.submit(client.request_classic(scene, outside))
    asked: list[str] = []
    team = WatchedTeam(looks=lambda request, _: asked.append(request.id))
    folder = client.spool.folder
    assert run_worker(folder, team=team, stopped=lambda: bool(asked)) == 0
    assert client.spool.status(job).state is JobState.RUNNING
    # asked again and again it waits for another worker each time
    for timeout_s, least_s in ((None, 0.4), (None, 0.4), (1.0, 1.0), (0.0, 0.0)):
        began = time.monotonic()
        with pytest.raises(WorkerLostError, match=r"no sign of life for 0\.4 s"):
            client.wait(job, timeout_s=timeout_s)
        assert least_s < time.monotonic() - began < least_s + 20.0
    done = threading.Event()
    worker = threading.Thread(
        target=run_worker,
        args=(folder,),
        kwargs={"lease_s": 0.3, "stopped": done.is_set},
    )
    worker.start()
    try:
        # The second worker also starts its clock when it first looks.
        while client.spool.status(job).attempt < 2:
            done.wait(0.02)
        # A machine with much to do may hold its heartbeat up for longer than a lease.
        patient = SnapshotClient(folder, name="test", lease_s=60)
        snapshot = patient.wait(job, timeout_s=120)
    finally:
        done.set()
        worker.join()
    assert snapshot.result.attempt == 2
    expected = ActiveRayTracer(scene).render(outside)
    assert snapshot.radiance().tobytes() == expected.rgba.tobytes()


def test_a_job_that_kills_its_workers_is_given_up(
    client: SnapshotClient, scene: Scene, outside: Camera
) -> None:
    job = client.submit(client.request_classic(scene, outside))
    assert client.spool.claim() is not None
    for attempt in range(2, MOST_ATTEMPTS + 1):
        assert client.spool.begin_attempt(job, attempt)
    looks = iter(range(40))
    run_worker(
        client.spool.folder, lease_s=0.05, stopped=lambda: next(looks, None) is None
    )
    with pytest.raises(SnapshotError, match="3 workers died"):
        client.wait(job)


def test_a_fault_of_ours_is_told_to_the_client_and_raised(
    client: SnapshotClient, scene: Scene, outside: Camera
) -> None:
    def broken(request: SnapshotRequest) -> None:
        raise ZeroDivisionError("by nothing")

    job = client.submit(client.request_classic(scene, outside))
    with pytest.raises(ZeroDivisionError):
        run_worker(client.spool.folder, once=True, team=WatchedTeam(broken))
    with pytest.raises(SnapshotError, match="the worker broke: ZeroDivisionError"):
        client.wait(job)


def test_when_ranks_are_lost_the_job_is_left_to_the_next_worker(
    client: SnapshotClient, scene: Scene, outside: Camera
) -> None:
    def lost(request: SnapshotRequest) -> None:
        raise TransportError("rank 2 died")

    job = client.submit(client.request_classic(scene, outside))
    with pytest.raises(TransportError, match="rank 2 died"):
        run_worker(client.spool.folder, once=True, team=WatchedTeam(lost))
    assert client.spool.status(job).state is JobState.RUNNING
    looks = iter(range(2000))
    run_worker(
        client.spool.folder,
        lease_s=0.05,
        stopped=lambda: (
            client.spool.status(job).state.is_final or next(looks, None) is None
        ),
    )
    assert client.wait(job).result.attempt == 2


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EROFS, errno.EDQUOT])
def test_a_full_disk_is_outlasted(
    client: SnapshotClient,
    scene: Scene,
    outside: Camera,
    number: int,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """A job that meets it is drawn once there is room; it is told once."""
    job = client.submit(client.request_classic(scene, outside))
    monkeypatch.setattr(worker, "REFUSED_S", 0.01)
    refusals = [OSError(number, os.strerror(number))] * 3

    claim = Spool.claim

    def claimed(spool: Spool) -> Claim | None:
        if refusals:
            raise refusals.pop()
        return claim(spool)

    monkeypatch.setattr(Spool, "claim", claimed)
    assert run_worker(client.spool.folder, once=True) == 1
    assert client.wait(job).picture.exists()
    first, second = capsys.readouterr().err.splitlines()
    assert os.strerror(number) in first
    assert "served again" in second


def test_a_disk_that_fills_while_a_job_is_drawn_leaves_it_to_the_next(
    client: SnapshotClient,
    scene: Scene,
    outside: Camera,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Not even that it failed can be written then."""
    job = client.submit(client.request_classic(scene, outside))
    monkeypatch.setattr(worker, "REFUSED_S", 0.01)
    write, has_room = Spool.set_status, [False]

    def status(spool: Spool, job_id: str, told: JobStatus) -> None:
        if told.state.is_final and not has_room[0]:
            has_room[0] = True
            raise OSError(errno.ENOSPC, "No space left on device")
        write(spool, job_id, told)

    monkeypatch.setattr(Spool, "set_status", status)
    assert run_worker(client.spool.folder, once=True, lease_s=0.2) == 1
    assert client.wait(job).result.attempt == 2


def test_a_folder_that_was_taken_away_ends_its_worker(
    client: SnapshotClient,
) -> None:
    folder = client.spool.folder
    asked: list[bool] = []

    def stopped() -> bool:
        if not asked:
            shutil.rmtree(folder)
        asked.append(True)
        return len(asked) > 5

    with pytest.raises(SpoolError, match="is not there any more"):
        run_worker(folder, stopped=stopped)


JOB = "ab" * 16
PATIENCE_S = 30.0


@pytest.fixture
def begun(tmp_path: Path) -> Spool:
    spool = Spool(tmp_path / "spool")
    spool.job_folder(JOB).mkdir()
    spool.begin_attempt(JOB, 1)
    return spool


def wait_for(what: Callable[[], bool]) -> None:
    """Wait until something holds that the heart's own thread brings about."""
    for _ in range(round(PATIENCE_S / 0.01)):
        if what():
            return
        threading.Event().wait(0.01)
    raise AssertionError(f"nothing came of it within {PATIENCE_S:g} s")


def test_a_busy_worker_is_alive_and_tells_its_share(begun: Spool) -> None:
    with Heartbeat(begun, JOB, 1) as heart:
        heart.done = 0.25
        wait_for(lambda: begun.status(JOB).done == 0.25)
        heart.done = 0.5
        wait_for(lambda: begun.status(JOB).done == 0.5)
        assert begun.status(JOB).heartbeat >= 2
        assert heart.may_go_on()
    assert not heart.is_over


def test_late_jobs_fail_for_the_first_limit_that_was_passed(begun: Spool) -> None:
    with Heartbeat(begun, JOB, 1) as heart:
        heart.limit(3600.0, "much later")
        heart.limit(-1.0, "too late")
        wait_for(lambda: begun.status(JOB).state is JobState.FAILED)
        assert not heart.look()
    assert begun.status(JOB).message == "too late"


def test_the_last_word_is_the_last(begun: Spool) -> None:
    with Heartbeat(begun, JOB, 1) as heart:
        heart.end(JobState.DONE)
        heart.done = 0.1
        begun.ask_cancel(JOB)
        heart.end(JobState.FAILED, "no")
        assert not heart.look()
    assert heart.is_over
    assert begun.status(JOB).state is JobState.DONE


def test_who_lost_the_job_says_nothing_more(begun: Spool) -> None:
    with Heartbeat(begun, JOB, 1) as heart:
        assert Spool(begun.folder).begin_attempt(JOB, 2)
        heart.end(JobState.DONE)
        assert not heart.may_go_on()
        assert not heart.is_over
    assert begun.status(JOB) == JobStatus(JobState.RUNNING, 2)
