import math
from typing import Any

import msgspec
import numpy as np
import pytest

from renderers.art.quality import QUALITIES
from renderers.snapshots.request import (
    LARGEST_REQUEST,
    REQUEST_SCHEMA,
    CameraSpec,
    ClassicWork,
    GridSpec,
    ImageSpec,
    NodeSpec,
    ScopeWork,
    SnapshotRequest,
    decode_request,
)

DIGEST = "0123456789abcdef" * 4
GRID = GridSpec((1.0, 1, 1), (0.0, 0, 0), ((1.0, 0, 0), (0.0, 1, 0), (0.0, 0, 1)))
CAMERA = CameraSpec((0.0, 0, 0), ((1.0, 0, 0), (0.0, 0, 1), (0.0, -1, 0)), 0.7)
SCOPE = SnapshotRequest(
    schema=REQUEST_SCHEMA,
    id="ab" * 16,
    camera=CAMERA,
    image=ImageSpec(64, 48, 4),
    work=ScopeWork(DIGEST, DIGEST, DIGEST, GRID),
)
NODES = (NodeSpec(0.0, (1.0, 1, 1), 0.0), NodeSpec(9.0, (1.0, 1, 1), 2.0))
CLASSIC = msgspec.structs.replace(
    SCOPE, work=ClassicWork(DIGEST, GRID, NODES), image=ImageSpec(64, 48)
)


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
    ],
)
def test_what_is_wrong_is_refused_by_name(path: str, value: Any) -> None:
    with pytest.raises(ValueError, match=r"must be|cannot be|not known") as caught:
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


def test_a_node_must_be_complete() -> None:
    record = changed(CLASSIC, "work.nodes", [{"density": 0.0}] * 2)
    with pytest.raises(ValueError, match=r"work\.nodes\[0\] has no 'color'"):
        decode_request(record)


def test_transfer_functions_are_integrated_unless_asked_otherwise() -> None:
    """Bent rays or not; a request has the classification of the quality it names."""
    ball = {"kind": "scale", "center_mm": [0.0, 0, 0], "radius_mm": 5.0, "factor": 1.5}
    record = msgspec.json.decode(changed(CLASSIC, "deflectors", [ball]))
    for quality in QUALITIES:
        record["quality"] = quality
        found = decode_request(msgspec.json.encode(record)).to_quality()
        assert found == QUALITIES[quality]
    record["classification"] = "post"
    found = decode_request(msgspec.json.encode(record)).to_quality()
    assert found.classification == "post"


def test_length_is_limited() -> None:
    record = msgspec.json.encode(SCOPE) + b" " * LARGEST_REQUEST
    with pytest.raises(ValueError, match="at most 262144 bytes"):
        decode_request(record)


def test_the_scope_has_a_scopes_lens() -> None:
    with pytest.raises(ValueError, match="equidistant lens"):
        decode_request(changed(SCOPE, "camera.projection", "perspective"))
    decode_request(changed(CLASSIC, "camera.projection", "orthographic"))


@pytest.mark.parametrize("junk", [b"", b"[]", b"\x80\x04N.", b"{", b'"text"'])
def test_junk_is_refused(junk: bytes) -> None:
    with pytest.raises(ValueError, match=r"."):
        decode_request(junk)


def test_the_default_request_asks_for_finite_things() -> None:
    for value in msgspec.to_builtins(CAMERA).values():
        if isinstance(value, float):
            assert math.isfinite(value)
    assert np.all(np.isfinite(SCOPE.to_camera().frame))
