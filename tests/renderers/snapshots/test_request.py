from pathlib import Path
from typing import Any

import msgspec
import pytest
from numpy.testing import assert_array_equal

from renderers.art import ActiveRayTracer
from renderers.art.quality import QUALITIES
from renderers.art.ranks.policy import CellPolicy, Dataflow
from renderers.scene import Camera, Scene
from renderers.scene.lens_state import CLEAN, LensState, all_over
from renderers.snapshots.client import SnapshotClient
from renderers.snapshots.request import (
    CutSpec,
    DeflectorSpec,
    ImageSpec,
    RotationSpec,
    ScalingSpec,
    ScopeWork,
    SnapshotRequest,
    TranslationSpec,
    decode_request,
    to_deflection,
)
from renderers.snapshots.worker import run_worker
from tests.renderers.snapshots import bare_requests
from tests.renderers.snapshots.bare_requests import DIGEST, bare_request
from tests.renderers.snapshots.threaded_end import threaded_team

SCOPE = bare_request(0xAB, image=ImageSpec(64, 48, 4))
CLASSIC = msgspec.structs.replace(
    SCOPE, work=bare_requests.CLASSIC, image=ImageSpec(64, 48)
)
BALL = {"kind": "scale", "center_mm": [0.0, 0, 0], "radius_mm": 5.0, "factor": 1.5}


def changed(request: SnapshotRequest, path: str, value: Any) -> bytes:
    """Set, or with a new name add, one field of a request's JSON."""
    tree = msgspec.json.decode(msgspec.json.encode(request))
    *way, last = path.split(".")
    place = tree
    for name in way:
        place = place[int(name) if name.isdigit() else name]
    place[int(last) if last.isdigit() else last] = value
    return msgspec.json.encode(tree)


@pytest.mark.parametrize("request_", [SCOPE, CLASSIC])
def test_a_request_survives_its_bytes(request_: SnapshotRequest) -> None:
    assert decode_request(msgspec.json.encode(request_)) == request_


def test_a_request_is_seen_through_what_lies_on_the_lens() -> None:
    dirty = LensState((0.3, 0, 0, 0, 0, 0, 0, 0.1), all_over(0.2), 0.2, 0.5, 4)
    seen = decode_request(msgspec.json.encode(SCOPE.through(dirty)))
    assert isinstance(seen.work, ScopeWork)
    assert seen.work.lens == dirty
    for request, lens in ((SCOPE, CLEAN), (CLASSIC, dirty)):
        assert request.through(lens) == request


def test_a_request_becomes_a_camera_and_a_quality() -> None:
    camera = SCOPE.to_camera()
    assert (camera.width, camera.height) == (64, 48)
    assert camera.frame[3].tolist() == [0, -1, 0]
    finer = msgspec.structs.replace(SCOPE, step_voxels=0.125)
    assert SCOPE.to_quality().step_voxels == 0.5
    assert finer.to_quality().step_voxels == 0.125
    assert finer.to_quality().cutoff == SCOPE.to_quality().cutoff


@pytest.mark.parametrize(
    ("path", "value"),
    [
        ("colour", 1),
        ("work.gian", 2.0),
        ("camera.extent", "wide"),
        ("camera.extent", -0.5),
        ("camera.extent", 1e99),
        ("camera.axes", [[1, 0, 0], [0, 1, 0], [0, 1, 0]]),
        ("camera.projection", "fisheye"),
        ("image.width", 0),
        ("image.width", 100_000),
        ("image.width", 64.5),
        ("image.samples", 3),
        ("work.mode", "classics"),
        ("work.distance", "../../etc/passwd"),
        ("work.distance", DIGEST[:-1]),
        ("work.distance", DIGEST + "\n"),
        ("work.distance", DIGEST.upper()),
        ("work.blood_bias", -1),
        ("work.grid.spacing_mm", [1, 1]),
        ("work.grid.spacing_mm.1", 0),
        ("work.grid.origin_mm.2", None),
        ("id", "../x"),
        ("quality", "best"),
        ("priority", 10),
        ("schema", "paravol.snapshot.request/1"),
        ("max_seconds", 0),
        ("work.truth", {"paths": 31}),
        ("work.truth", {"paths": "many"}),
        ("work.truth", {"path": 64}),
        ("deflectors", [BALL | {"kind": "melt"}]),
        ("deflectors", [BALL | {"radius_mm": -1}]),
        ("deflectors", [BALL | {"strength": 3}]),
        ("deflectors", [BALL | {"factor": 30.0}]),
    ],
)
def test_what_is_wrong_is_refused_by_name(path: str, value: Any) -> None:
    with pytest.raises(
        ValueError, match=r"must be|cannot be|not known|would fold"
    ) as caught:
        decode_request(changed(SCOPE, path, value))
    named = path.split(".")
    said = str(caught.value)
    assert any(name in said for name in named), said
    assert "`" not in said


@pytest.mark.parametrize("number", ["NaN", "Infinity", "1e999", "-1e999"])
def test_numbers_are_finite(number: str) -> None:
    record = changed(SCOPE, "camera.extent", 12.25)
    with pytest.raises(ValueError, match=r"malformed|out of range|extent"):
        decode_request(record.replace(b"12.25", number.encode()))


def test_transfer_functions_are_integrated_unless_asked_otherwise() -> None:
    """Bent rays or not; a request has the classification of the quality it names."""
    record = msgspec.json.decode(changed(CLASSIC, "deflectors", [BALL]))
    for quality in QUALITIES:
        record["quality"] = quality
        found = decode_request(msgspec.json.encode(record)).to_quality()
        assert found == QUALITIES[quality]
    record["classification"] = "post"
    found = decode_request(msgspec.json.encode(record)).to_quality()
    assert found.classification == "post"


def test_the_scope_has_a_scopes_lens() -> None:
    with pytest.raises(ValueError, match="equidistant lens"):
        decode_request(changed(SCOPE, "camera.projection", "perspective"))
    decode_request(changed(CLASSIC, "camera.projection", "orthographic"))


@pytest.mark.parametrize("junk", [b"", b"[]", b"\x80\x04N.", b"{", b'"text"'])
def test_junk_is_refused(junk: bytes) -> None:
    with pytest.raises(ValueError, match=r"."):
        decode_request(junk)


def specs(scene: Scene) -> tuple[DeflectorSpec, ...]:
    x, y, z = (float(v) for v in scene.volume.center_mm)
    return (
        RotationSpec((x, y, z), 6.0, (1.0, 0.0, 0.5), 40.0),
        TranslationSpec((x + 2, y, z), 5.0, (1.0, 1.0, 0.0)),
        ScalingSpec((x, y + 2, z), 4.0, 1.5),
        CutSpec((x + 1, y, z), 5.0, (1.0, 0.0, 0.0), 0.7),
    )


@pytest.mark.parametrize(
    "policy", [Dataflow.REPLICATED, Dataflow.STATIC, Dataflow.MIGRATING]
)
def test_ranks_draw_what_one_tracer_draws(
    tmp_path: Path, scene: Scene, outside: Camera, inside: Camera, policy: Dataflow
) -> None:
    client = SnapshotClient(tmp_path / "spool")
    moved = specs(scene)
    assert scene.surface is not None
    classic = client.request_classic(scene, outside)
    scope = client.request_scope(scene.surface, inside.with_size(48, 40), samples=1)
    requests = [
        msgspec.structs.replace(each, deflectors=moved) for each in (classic, scope)
    ]
    for request in requests:
        client.submit(request)
    with threaded_team(client.data, CellPolicy(None, policy)) as team:
        assert run_worker(client.spool.folder, once=True, team=team)
    tracer = ActiveRayTracer(scene, deflection=to_deflection(moved))
    drawn = client.wait(requests[0].id)
    assert drawn.result.counters["deflected"] > 0
    assert_array_equal(drawn.radiance(), tracer.render(outside).rgba)
    found = tracer.gbuffer(inside.with_size(48, 40))
    assert_array_equal(client.wait(requests[1].id).depth_mm(), found.depth_mm)
