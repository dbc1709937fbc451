"""A view survives being a file to the last bit; what is wrong is refused by name."""

import json
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from paravol.snapshots.view_file import (
    CaseHead,
    ClassicLook,
    PhantomHead,
    ScanHead,
    ScopeLook,
    ViewCamera,
    ViewFile,
    both_eyes,
    exposed,
    load_view,
    save_view,
)
from renderers.scene import Camera, Projection, UpWarning

coordinate = st.floats(-500, 500)


def made(eye: Any, target: Any, extent: float = 0.7) -> ViewFile:
    camera = Camera.looking_at(eye, target, up=(0.3, 0.2, 1.0), extent=extent)
    return ViewFile("paravol.view/1", PhantomHead(), ViewCamera.of(camera))


@given(
    st.tuples(coordinate, coordinate, coordinate),
    st.floats(0.01, 1.5),
    st.tuples(st.floats(0, 1), st.floats(0, 1)),
)
def test_a_camera_comes_back_to_the_last_bit(
    eye: tuple[float, float, float], extent: float, distortion: tuple[float, float]
) -> None:
    view = made(eye, (eye[0] + 3, eye[1] + 17, eye[2] - 5), extent)
    bent = msgspec.structs.replace(view.camera, distortion=distortion)
    view = msgspec.structs.replace(view, camera=bent)
    again = msgspec.json.decode(msgspec.json.encode(view), type=ViewFile)
    assert again == view
    camera, other = view.to_camera(), again.to_camera()
    assert_array_equal(other.frame, camera.frame)
    assert other.key == camera.key
    assert other.extent == extent
    assert (other.distortion.k1, other.distortion.k2) == distortion


def test_a_file_written_by_hand_is_understood(tmp_path: Path) -> None:
    path = tmp_path / "sub" / "my.view.json"
    path.parent.mkdir()
    path.write_text(
        json.dumps(
            {
                "schema": "paravol.view/1",
                "head": {"kind": "case", "folder": "../case"},
                "camera": {
                    "eye_mm": [0, 0, 0],
                    "target_mm": [0, 5, 0],
                    "extent": 30,
                    "projection": "orthographic",
                },
                "look": {"mode": "classic"},
                "size_px": [64, 32],
            }
        )
    )
    view = load_view(path)
    assert view.head == CaseHead(str(path.parent / "../case"))
    camera = view.to_camera()
    assert camera.projection is Projection.ORTHOGRAPHIC
    assert_array_equal(camera.frame[3], [0, 1, 0])
    assert (camera.width, camera.height) == (64, 32)


def test_full_paths_stay(tmp_path: Path) -> None:
    path = tmp_path / "a.view.json"
    view = made((0, 0, 0), (0, 9, 1))
    for head in (ScanHead("/data/scan.nrrd"), CaseHead("/data/case")):
        save_view(path, msgspec.structs.replace(view, head=head))
        assert load_view(path).head == head
    assert [p.name for p in tmp_path.iterdir()] == ["a.view.json"]


def seen(extent: float = 1.0, **more: Any) -> dict[str, Any]:
    return {"camera": {"eye_mm": [0, 0, 0], "extent": extent, **more}}


def held(name: str, **more: Any) -> dict[str, Any]:
    told = {"name": name, "world_from_instrument": np.eye(4)[:3].tolist()}
    return {"instruments": [{**told, **more}]}


SKEW = [[1, 1, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]]


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({"schema": "paravol.view/2"}, "schema"),
        ({"zoom": 2}, "'zoom'"),
        ({"size_px": [4, 512]}, r"size_px\[0\]"),
        ({"head": {"kind": "statue"}}, "head.kind"),
        ({"look": {"mode": "scope", "gain": -1}}, "look.gain"),
        ({"surface_sha256": "abc"}, "surface_sha256"),
        (seen(), "axes or target_mm"),
        (seen(target_mm=[0, 0, 0]), "points coincide"),
        (seen(2.0, target_mm=[0, 1, 0]), "extent out of range: 2"),
        (seen(axes=[[1, 0, 0], [0, 1, 0], [1, 0, 0]]), "orthonormal"),
        (held("suction tube", world_from_instrument=SKEW), "rigid"),
        (held("chisel"), "'chisel'"),
        (held("straight forceps", jaw=1.5), r"jaw .* 1\.5"),
    ],
)
def test_what_is_wrong_is_refused_by_name(
    tmp_path: Path, change: dict[str, Any], named: str
) -> None:
    path = tmp_path / "a.view.json"
    record = msgspec.to_builtins(made((0, 0, 0), (0, 9, 1))) | change
    path.write_text(json.dumps(record))
    with pytest.raises(ValueError, match=named) as caught:
        load_view(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_what_is_no_view_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"cannot be read \(No such file"):
        load_view(tmp_path / "none.json")
    path = tmp_path / "a.view.json"
    path.write_bytes(b"\x89PNG")
    with pytest.raises(ValueError, match="is not valid"):
        load_view(path)
    path.write_bytes(b" " * 300_000)
    with pytest.raises(ValueError, match="larger than 262144 bytes"):
        load_view(path)


def test_an_up_along_the_view_is_told_once_and_then_settled(tmp_path: Path) -> None:
    path = tmp_path / "down.view.json"
    camera = {"eye_mm": [0, 0, 40], "target_mm": [0, 0, 0], "extent": 0.7}
    record = {"schema": "paravol.view/1", "head": {"kind": "phantom"}, "camera": camera}
    path.write_text(json.dumps(record))
    with pytest.warns(UpWarning, match=r"\[1, 0, 0\] is taken for it"):
        view = load_view(path)
    assert_array_equal(view.to_camera().frame[2], [1, 0, 0])
    save_view(path, view)
    assert load_view(path) == view


VIEW = ViewFile(
    "paravol.view/1",
    PhantomHead(),
    ViewCamera(
        (3.0, 0.0, 1.0), 0.6, target_mm=(9.0, 30.0, 4.0), projection="perspective"
    ),
    size_px=(400, 300),
    look=ClassicLook(),
)


@pytest.mark.parametrize("away", [5.0, 20.0, 80.0])
@pytest.mark.parametrize("apart", [0.5, 3.0])
def test_disparity_is_focal_length_times_base_over_depth(
    away: float, apart: float
) -> None:
    middle = VIEW.to_camera()
    point = middle.eye_mm + away * middle.frame[3] + 0.7 * middle.frame[2]
    left, right = (view.to_camera() for view in both_eyes(VIEW, apart))
    a, b = (eye.project(point)[0] for eye in (left, right))
    focal_px = 150 / np.tan(0.6)
    assert a[0] - b[0] == pytest.approx(focal_px * apart / away, rel=1e-9)
    assert a[1] == pytest.approx(b[1], abs=1e-9)
    np.testing.assert_allclose((left.eye_mm + right.eye_mm) / 2, middle.eye_mm)


def test_exposure_is_fixed_where_there_is_a_camera() -> None:
    assert exposed(VIEW, 3.0) is VIEW
    assert exposed(VIEW, None) is VIEW
    scope = ViewFile("paravol.view/1", PhantomHead(), VIEW.camera, look=ScopeLook())
    look = exposed(scope, 3.0).look
    assert isinstance(look, ScopeLook)
    assert look.gain == 3.0
