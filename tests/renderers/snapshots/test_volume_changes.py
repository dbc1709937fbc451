from typing import Any

import hypothesis.strategies as st
import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis.extra import numpy as arrays
from numpy.testing import assert_array_equal
from numpy.typing import NDArray

from renderers.art import ActiveRayTracer
from renderers.art.ranks.policy import CellPolicy, Dataflow
from renderers.scene import Camera, Scene
from renderers.shading import ScopeLight, ScopeShader, Tier
from renderers.snapshots.client import SnapshotClient
from renderers.snapshots.request import SnapshotRequest, decode_request
from renderers.snapshots.result_cache import picture_key, trace_key
from renderers.snapshots.scene_loader import load_scene, scene_key
from renderers.snapshots.spool import Spool
from renderers.snapshots.volume_changes import EDGE, FrozenSurface, VolumeChanges
from renderers.snapshots.worker import run_worker
from system import UserError
from tests.operated import Operated
from tests.renderers.snapshots.threaded_end import threaded_team

SHAPES = arrays.array_shapes(min_dims=3, max_dims=3, min_side=2, max_side=21)
TYPES = st.sampled_from([np.float32, np.int16, np.uint8, np.uint16])


@st.composite
def edits(draw: st.DrawFn) -> tuple[NDArray[Any], NDArray[Any]]:
    """Draw a volume and another with some voxels changed, bits included."""
    shape, kind = draw(SHAPES), draw(TYPES)
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    base = rng.integers(0, 200, shape).astype(kind)
    edited = base.copy()
    for place in rng.integers(0, shape, (draw(st.integers(0, 12)), 3)).tolist():
        edited[tuple(place)] = rng.integers(0, 200)
    if kind is np.float32 and draw(st.booleans()):
        base[0, 0, 0], edited[0, 0, 0] = 0.0, -0.0
    return base, edited


@given(edits())
def test_bricks_bring_any_edit_back_to_the_bit(
    pair: tuple[NDArray[Any], NDArray[Any]],
) -> None:
    base, edited = pair
    before = base.tobytes()
    found = VolumeChanges.between(base, edited)
    read = VolumeChanges.of_record(found.record(), base, "changes")
    applied = read.applied(base)
    assert applied.dtype == edited.dtype
    assert applied.tobytes() == edited.tobytes()
    assert base.tobytes() == before
    assert len(found) == 0 or not np.shares_memory(applied, base)
    # no brick for nothing, and undoing is an edit like any other
    changed = np.argwhere(base.view(np.uint8) != edited.view(np.uint8))
    scale = np.array([1, 1, base.itemsize])
    bricks = {tuple(place) for place in (changed // scale // EDGE).tolist()}
    assert len(found) == len(bricks)
    back = VolumeChanges.between(edited, base).applied(edited)
    assert back.tobytes() == base.tobytes()


@given(edits(), arrays.arrays(np.int64, (2, 3), elements=st.integers(0, 5)))
def test_a_box_around_all_edits_finds_the_same_bricks(
    pair: tuple[NDArray[Any], NDArray[Any]], slack: NDArray[np.int64]
) -> None:
    base, edited = pair
    bits = np.dtype(f"u{base.itemsize}")
    places = np.argwhere(base.view(bits) != edited.view(bits))[:, ::-1]
    if not len(places):
        places = np.zeros((1, 3), np.int64)
    box = places.min(axis=0) - slack[0], places.max(axis=0) + slack[1]
    found = VolumeChanges.between(base, edited, box)
    assert_array_equal(found.record(), VolumeChanges.between(base, edited).record())


NAN = 0x7FC00000


@pytest.mark.parametrize(
    ("row", "column", "value"),
    [(1, 0, 27), (0, 0, -1), (1, 0, 0), (0, 0, 20), (1, 5, NAN), (None, 0, 0)],
)
def test_wrong_bricks_are_refused_by_name(
    row: int | None, column: int, value: int
) -> None:
    """Out of range, there twice, out of order, not finite, or too narrow a row."""
    base = np.zeros((20, 20, 20), np.float32)
    edited = base.copy()
    edited[3, 3, 3] = edited[12, 12, 12] = 1
    record = VolumeChanges.between(base, edited).record()
    assert record[:, 0].tolist() == [0, 13]
    if row is None:
        record = record[:, :-1]
    else:
        record[row, column] = value
    for wrong in (record, record.ravel()):
        with pytest.raises(UserError, match=r"^changes: "):
            VolumeChanges.of_record(wrong, base, "changes")


def test_a_worker_rejects_wrong_bricks_and_serves_the_next(
    client: SnapshotClient, scene: Scene, inside: Camera
) -> None:
    head = Operated.of(scene)
    head.bite((17, 13, 20), 4.0)
    good = client.request_scope(head.surface, inside, samples=1)
    assert good.work.changes is not None
    assert scene.surface is not None
    record = VolumeChanges.between(scene.surface.distance.values, head.distance)
    wrong = record.record()
    wrong[-1, 0] = 1 << 20
    spoilt = msgspec.structs.replace(
        good,
        id=f"{1:032x}",
        work=msgspec.structs.replace(good.work, changes=client.put(wrong)),
    )
    jobs = [client.submit(spoilt), client.submit(good)]
    run_worker(client.spool.folder, once=True)
    with pytest.raises(RuntimeError, match="rejected: changes: bricks must"):
        client.wait(jobs[0])
    assert client.wait(jobs[1]).result.complete


def test_an_array_edited_in_place_is_stored_again(client: SnapshotClient) -> None:
    array = np.arange(4096, dtype=np.float32)
    view = array[:]
    view.flags.writeable = False
    first = client.put(view)
    array[7] = -1
    second = client.put(view)
    assert second != first
    assert client.data.get(second, ("float32",), 1 << 20)[7] == -1
    assert client.data.get(first, ("float32",), 1 << 20)[7] == 7
    array[7] = 7
    assert client.put(view) == first


def test_an_unoperated_request_of_before_is_read_as_ever(
    client: SnapshotClient, scene: Scene, inside: Camera
) -> None:
    assert scene.surface is not None
    request = client.request_scope(scene.surface, inside)
    record = msgspec.json.decode(msgspec.json.encode(request))
    assert record["work"].pop("changes") is None
    assert record["work"].pop("wounds") is None
    assert decode_request(msgspec.json.encode(record)) == request


def scenes_of(client: SnapshotClient, request: SnapshotRequest) -> tuple[Any, ...]:
    found = load_scene(client.data, request)
    if found.surface is None:
        return (found.volume.values,)
    wounds = found.surface.wounds
    assert wounds is not None
    assert wounds.pale is not None
    layers = wounds.pristine, wounds.flesh, wounds.bone, wounds.deep, wounds.film
    return tuple(v.values for v in (found.surface.distance, *layers, wounds.pale))


@given(
    st.lists(st.sampled_from(["bite", "inject", "undo", "ask", "freeze"]), max_size=12)
)
def test_no_request_is_of_an_older_generation(
    tmp_path_factory: pytest.TempPathFactory,
    scene: Scene,
    inside: Camera,
    outside: Camera,
    steps: list[str],
) -> None:
    """Whatever edits and requests come in turn, each is of the moment it was made."""
    client = SnapshotClient(tmp_path_factory.mktemp("spool") / "spool")
    head, rng = Operated.of(scene), np.random.default_rng(len(steps))
    asked: list[tuple[SnapshotRequest, Scene]] = []
    frozen: list[tuple[FrozenSurface, Scene]] = []
    for step in [*steps, "ask"]:
        match step:
            case "bite":
                head.bite(tuple(rng.integers(4, 24, 3).tolist()), 3.0)
            case "inject":
                head.inject(tuple(rng.integers(4, 24, 3).tolist()), 4.0)
            case "undo":
                head.undo()
            case "freeze":
                frozen.append((FrozenSurface.of(head.surface), head.copy()))
            case "ask":
                now = head.copy()
                asked.append((client.request_scope(head.surface, inside), now))
                classic = request_of(client, head, outside, True)
                asked.append((classic, now))
    asked += [(client.request_scope(f, inside), then) for f, then in frozen]
    for request, then in asked:
        found = scenes_of(client, request)
        if len(found) == 1:
            assert_array_equal(found[0], then.volume.values)
            continue
        assert then.surface is not None
        assert then.surface.wounds is not None
        wounds = then.surface.wounds
        wanted = then.surface.distance, wounds.pristine, wounds.flesh, wounds.bone
        assert wounds.pale is not None
        more = wounds.deep, wounds.film, wounds.pale
        for one, other in zip(found, (*wanted, *more), strict=True):
            assert one.tobytes() == other.values.tobytes()


def test_undoing_all_gives_the_first_request_again(
    client: SnapshotClient, scene: Scene, inside: Camera, outside: Camera
) -> None:
    head = Operated.of(scene)

    def requests() -> list[SnapshotRequest]:
        return [
            client.request_scope(head.surface, inside),
            request_of(client, head, outside, True),
        ]

    first = requests()
    head.bite((17, 13, 20), 4.0)
    cut = requests()
    head.undo()
    for before, between, after in zip(first, cut, requests(), strict=True):
        for key in picture_key, trace_key, scene_key:
            assert key(before) == key(after) != key(between)
    assert scene.surface is not None
    unoperated = client.request_scope(scene.surface, inside)
    assert trace_key(unoperated) == trace_key(first[0])
    assert scene_key(unoperated) == scene_key(first[0])


def request_of(
    client: SnapshotClient, head: Operated, camera: Camera, classic: bool
) -> SnapshotRequest:
    if classic:
        cut = VolumeChanges.between(head.before.volume.values, head.ct)
        return client.request_classic(head.before, camera, changes=cut)
    return client.request_scope(head.surface, camera, samples=1)


@pytest.mark.parametrize("classic", [False, True])
@pytest.mark.parametrize("ranks", [3, pytest.param(1, marks=pytest.mark.slow)])
def test_a_workers_picture_is_the_direct_tracers(
    client: SnapshotClient,
    scene: Scene,
    inside: Camera,
    outside: Camera,
    classic: bool,
    ranks: int,
) -> None:
    """Edits, undoing and the head before, in turn, by one worker that keeps scenes."""
    head, camera = Operated.of(scene), outside if classic else inside
    asked = []
    for step in ("", "bite", "", "inject", "deeper", "undo", "other"):
        match step:
            case "bite":
                head.bite((17, 13, 20), 4.0)
            case "inject":
                head.inject((17, 13, 20), 6.0)
            case "deeper":
                head.bite((17, 10, 20), 5.0)
            case "undo":
                head.undo()
            case "other":
                head.bite((9, 13, 12), 4.0)
        asked.append((request_of(client, head, camera, classic), head.copy()))
    for request, _ in asked:
        client.submit(request)
    if ranks == 1:
        run_worker(client.spool.folder, once=True, cache_bytes=0)
    else:
        policy, data = CellPolicy(None, Dataflow.MIGRATING), Spool(client.spool.folder)
        with threaded_team(data.data, policy) as team:
            run_worker(client.spool.folder, once=True, team=team, cache_bytes=0)
    for request, then in asked:
        tracer = ActiveRayTracer(then, threads=1)
        snapshot = client.wait(request.id)
        assert snapshot.result.ranks == ranks
        if classic:
            expected = tracer.render(camera)
            assert snapshot.radiance().tobytes() == expected.rgba.tobytes()
        else:
            found = tracer.gbuffer(camera)
            assert snapshot.depth_mm().tobytes() == found.depth_mm.tobytes()
            assert then.surface is not None
            shader = ScopeShader(then.surface, Tier.FULL, threads=1)
            radiance = shader.shade(found, camera, ScopeLight(1.45))
            assert snapshot.radiance().tobytes() == radiance.tobytes()
