"""What a dead worker found is gone on with, to the same bits, or not looked at."""

from collections.abc import Callable
from pathlib import Path

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from renderers.art import ActiveRayTracer, render_among
from renderers.art.ranks.policy import CellPolicy, Dataflow
from renderers.art.regions import REGION_PX, Gather
from renderers.scene import Camera, Scene
from renderers.scene.composition import solids_seen
from renderers.snapshots import saved_work
from renderers.snapshots.client import SnapshotClient
from renderers.snapshots.request import PathTracingSpec, SnapshotRequest
from renderers.snapshots.saved_work import ENDING, SavedWork, code_key, unwrap, wrap
from renderers.snapshots.spool import Spool
from renderers.snapshots.team import RankTeam
from renderers.snapshots.worker import run_worker
from tests.renderers.snapshots.threaded_end import threaded_team
from tests.renderers.snapshots.watched_team import WatchedTeam
from tests.tools import rod

SIZE = (100, 86)
LEASE_S = 0.05


@pytest.fixture
def request_(client: SnapshotClient, scene: Scene, outside: Camera) -> SnapshotRequest:
    """Get a request that one attempt was begun at."""
    request = client.request_classic(scene, outside.with_size(*SIZE))
    client.submit(request)
    assert client.spool.claim() is not None
    return request


def saved(client: SnapshotClient, request: SnapshotRequest, attempt: int) -> SavedWork:
    client.spool.begin_attempt(request.id, attempt)
    return SavedWork(client.spool, request, attempt, 0.0)


def drawn(done: NDArray[np.bool_], seed: int = 0) -> Gather:
    """Make a gather of which some rays are done."""
    random = np.random.default_rng(seed)
    width, height = SIZE
    gather = Gather(width, height)
    gather.done[:] = done
    gather.missing -= int(np.count_nonzero(done))
    gather.value[done] = random.normal(size=(*done.shape, 4)).astype("f4")[done]
    gather.depth[done] = random.uniform(size=done.shape).astype("f4")[done]
    return gather


def files(client: SnapshotClient) -> list[Path]:
    return sorted(client.spool.jobs.glob(f"*/*/*{ENDING}"))


@settings(max_examples=15, deadline=None)
@given(data=st.data())
def test_finished_squares_come_back_and_nothing_else(
    tmp_path_factory: pytest.TempPathFactory,
    scene: Scene,
    outside: Camera,
    data: st.DataObject,
) -> None:
    client = SnapshotClient(tmp_path_factory.mktemp("spool"))
    request = client.request_classic(scene, outside.with_size(*SIZE))
    client.submit(request)
    assert client.spool.claim() is not None
    width, height = SIZE
    rows, columns = -(-height // REGION_PX), -(-width // REGION_PX)
    steps = data.draw(
        st.lists(st.sets(st.integers(0, rows * columns - 1)), min_size=1, max_size=3)
    )
    done = np.zeros((height, width), np.bool_)
    squares = np.zeros(rows * columns, np.bool_)
    found = drawn(np.ones_like(done))
    # each attempt takes over what was saved, finds more, saves that and dies
    for attempt, more in enumerate(steps, 1):
        work = saved(client, request, attempt)
        gather = Gather(width, height)
        assert work.restore(gather) == np.count_nonzero(done)
        squares[list(more)] = True
        for k in np.flatnonzero(squares).tolist():
            top, left = k // columns * REGION_PX, k % columns * REGION_PX
            done[top : top + REGION_PX, left : left + REGION_PX] = True
        gather.value[done], gather.depth[done] = found.value[done], found.depth[done]
        gather.done[done] = True
        # a square that lacks a ray is not finished
        odd = np.flatnonzero(~squares)
        if odd.size:
            top, left = odd[0] // columns * REGION_PX, odd[0] % columns * REGION_PX
            gather.done[top, left + 1 : left + REGION_PX] = True
        work.save_rays(gather)
    last = Gather(width, height)
    assert saved(client, request, 9).restore(last) == np.count_nonzero(done)
    assert np.array_equal(last.done, done)
    assert last.missing == done.size - np.count_nonzero(done)
    assert last.value[done].tobytes() == found.value[done].tobytes()
    assert last.depth[done].tobytes() == found.depth[done].tobytes()
    assert not last.value[~done].any()


def test_what_is_saved_once_is_not_saved_again(
    client: SnapshotClient, request_: SnapshotRequest
) -> None:
    work = saved(client, request_, 1)
    gather = drawn(np.ones(SIZE[::-1], np.bool_))
    work.save_rays(gather)
    work.save_rays(gather)
    assert len(files(client)) == 1
    second = saved(client, request_, 2)
    second.restore(Gather(*SIZE))
    second.save_rays(gather)
    assert len(files(client)) == 1


@settings(max_examples=40, deadline=None)
@given(body=st.binary(max_size=300), flip=st.integers(0, 8 * 300), cut=st.integers(0))
def test_a_damaged_record_is_none(body: bytes, flip: int, cut: int) -> None:
    key = bytes(range(32))
    record = wrap(key, body)
    assert unwrap(record) == (key, body)
    flip %= 8 * len(record)
    damaged = bytearray(record)
    damaged[flip // 8] ^= 1 << flip % 8
    assert unwrap(bytes(damaged)) is None
    assert unwrap(record[: cut % len(record)]) is None
    assert unwrap(record + b"\0") is None


@pytest.mark.parametrize("wrong", ["byte", "half", "request", "code"])
def test_what_is_not_this_pictures_is_not_looked_at(
    client: SnapshotClient,
    request_: SnapshotRequest,
    monkeypatch: pytest.MonkeyPatch,
    wrong: str,
) -> None:
    work = saved(client, request_, 1)
    work.save_rays(drawn(np.ones(SIZE[::-1], np.bool_)))
    work.save_paths(np.ones((*SIZE[::-1], 7)))
    asked = request_
    for path in files(client):
        record = path.read_bytes()
        if wrong == "byte":
            path.write_bytes(record[:-7] + bytes([record[-7] ^ 4]) + record[-6:])
        elif wrong == "half":
            path.write_bytes(record[: len(record) // 2])
    if wrong == "request":
        asked = msgspec.structs.replace(request_, quality="final")
    elif wrong == "code":
        monkeypatch.setattr(saved_work, "code_key", lambda: b"older")
    gather = Gather(*SIZE)
    other = saved(client, asked, 2)
    assert other.restore(gather) == 0
    assert other.paths() is None
    assert not gather.done.any()
    assert gather.missing == gather.done.size


def test_the_code_is_known_by_its_sources(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    package = tmp_path / "renderers" / "art"
    package.mkdir(parents=True)
    (package / "kernels.py").write_text("STEP = 1\n")
    monkeypatch.setattr(saved_work, "__file__", str(package / "saved_work.py"))
    keys = []
    for text in ("STEP = 1\n", "STEP = 2\n", "STEP = 1\n"):
        (package / "kernels.py").write_text(text)
        keys.append(code_key.__wrapped__())
    assert keys[0] == keys[2] != keys[1]


def die_at(client: SnapshotClient, share: float) -> Callable[..., None]:
    def looks(request: SnapshotRequest, done: float) -> None:
        if done >= share:
            raise KeyboardInterrupt

    return looks


def take_over(client: SnapshotClient, team: RankTeam | None = None) -> None:
    run_worker(client.spool.folder, once=True, threads=1, lease_s=LEASE_S, team=team)


@pytest.mark.usefixtures("steady_pace")
def test_a_job_taken_over_goes_on_where_it_was(
    client: SnapshotClient, scene: Scene, outside: Camera
) -> None:
    camera = outside.with_size(256, 512)
    middle = scene.volume.center_mm
    tools = [rod(middle, middle + np.array([15.0, -20, 12]))]
    job = client.submit(client.request_classic(scene, camera, instruments=tools))
    for share in (0.3, 0.6):
        # dies without a word, twice
        team = WatchedTeam(looks=die_at(client, share))
        with pytest.raises(KeyboardInterrupt):
            run_worker(
                client.spool.folder, team=team, lease_s=LEASE_S, save_every_s=0.0
            )
    assert files(client)
    take_over(client)
    snapshot = client.wait(job)
    alone = ActiveRayTracer(scene, threads=1)
    expected = render_among(alone, camera, solids_seen(camera, tools))
    assert snapshot.radiance().tobytes() == expected.rgba.tobytes()
    assert expected.depth_mm is not None
    assert snapshot.depth_mm().tobytes() == expected.depth_mm.tobytes()
    assert alone.report is not None
    counters = snapshot.result.counters
    assert snapshot.result.attempt == 3
    assert 0.4 < counters["rays_kept"] / (256 * 512) < 1
    assert 0 < counters["samples"] < alone.report.counters["samples"]
    assert not files(client), "what was saved is gone with the job"


@pytest.mark.usefixtures("steady_pace")
@pytest.mark.parametrize("dataflow", [Dataflow.MIGRATING, Dataflow.STATIC])
def test_ranks_go_on_with_what_one_process_found(
    client: SnapshotClient, scene: Scene, outside: Camera, dataflow: Dataflow
) -> None:
    camera = outside.with_size(200, 170)
    job = client.submit(client.request_classic(scene, camera))
    team = WatchedTeam(looks=die_at(client, 0.4))
    with pytest.raises(KeyboardInterrupt):
        run_worker(client.spool.folder, team=team, save_every_s=0.0)
    kept = Gather(200, 170)
    request = msgspec.json.decode(
        (client.spool.job_folder(job) / "request.json").read_bytes(),
        type=SnapshotRequest,
    )
    rays = SavedWork(client.spool, request, 2).restore(kept)
    assert 0 < rays < kept.done.size
    data = Spool(client.spool.folder).data
    with threaded_team(data, CellPolicy(None, dataflow)) as ranks:
        take_over(client, ranks)
    snapshot = client.wait(job)
    assert snapshot.result.ranks == 3
    assert snapshot.result.counters["rays_kept"] == rays
    expected = ActiveRayTracer(scene, threads=1).render(camera)
    assert snapshot.radiance().tobytes() == expected.rgba.tobytes()


def test_light_by_paths_is_gone_on_with_to_the_same_bits(
    client: SnapshotClient,
    scene: Scene,
    inside: Camera,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert scene.surface is not None
    truth = PathTracingSpec(paths=96)
    jobs = []
    for _ in range(2):
        request = client.request_scope(
            scene.surface, inside.with_size(48, 40), samples=1, path_tracing=truth
        )
        jobs.append(request)
    client.submit(jobs[0])
    run_worker(client.spool.folder, once=True, threads=1)
    whole = client.wait(jobs[0].id)
    client.submit(jobs[1])
    counted: list[NDArray[np.float64]] = []
    save = SavedWork.save_paths

    def dying(work: SavedWork, state: NDArray[np.float64]) -> None:
        save(work, state)
        counted.append(state[..., 6])
        if len(counted) == 4:
            raise KeyboardInterrupt

    monkeypatch.setattr(SavedWork, "save_paths", dying)
    with pytest.raises(KeyboardInterrupt):
        run_worker(client.spool.folder, threads=1, save_every_s=0.0)
    monkeypatch.undo()
    found = SavedWork(client.spool, jobs[1], 2).paths()
    assert found is not None
    assert 0 < counted[-1].sum() == found[..., 6].sum() < whole.state()[..., 6].sum()
    take_over(client)
    again = client.wait(jobs[1].id)
    assert again.result.attempt == 2
    assert again.state().tobytes() == whole.state().tobytes()
    assert again.radiance().tobytes() == whole.radiance().tobytes()
    assert again.result.digests["picture.png"] != ""
    assert np.array_equal(again.pixels(), whole.pixels())
    assert not files(client)


def test_a_disk_that_refuses_does_not_spoil_the_picture(
    client: SnapshotClient,
    scene: Scene,
    outside: Camera,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    tried: list[str] = []

    def refuse(path: Path, record: bytes, *, lasting: bool = True) -> None:
        tried.append(path.name)
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(saved_work, "write_whole", refuse)
    job = client.submit(client.request_classic(scene, outside.with_size(300, 260)))
    run_worker(client.spool.folder, once=True, threads=1, save_every_s=0.0)
    assert len(tried) == 1, "it is not tried again"
    expected = ActiveRayTracer(scene, threads=1).render(outside.with_size(300, 260))
    assert client.wait(job).radiance().tobytes() == expected.rgba.tobytes()
