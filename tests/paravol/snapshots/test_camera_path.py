"""A camera stands on its keys and stays between them."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from paravol.snapshots.camera_path import (
    CameraPath,
    PathKey,
    load_camera_path,
    views_along,
)
from paravol.snapshots.view_file import PhantomHead, ViewCamera, ViewFile
from renderers.scene import UpWarning

VIEW = ViewFile(
    "paravol.view/1",
    PhantomHead(),
    ViewCamera((0.0, 0.0, 0.0), 0.7, target_mm=(0.0, 1.0, 0.0)),
    size_px=(32, 16),
)

place = st.tuples(*[st.floats(-100, 100)] * 3)


@given(st.lists(place, min_size=2, max_size=6), st.floats(0.1, 10))
def test_it_stands_on_its_keys_and_never_swings_out(
    eyes: list[tuple[float, float, float]], step: float
) -> None:
    keys = tuple(
        PathKey(step * k, eye, (eye[0], eye[1] + 1 + k, eye[2] + 0.5))
        for k, eye in enumerate(eyes)
    )
    path = CameraPath("paravol.camera-path/1", keys)
    times = np.linspace(0, step * (len(keys) - 1), 8 * (len(keys) - 1) + 1)
    cameras = [v.to_camera() for v in views_along(path, VIEW, times)]
    for k, key in enumerate(keys):
        wanted = ViewCamera(key.eye_mm, 0.7, target_mm=key.target_mm).camera((32, 16))
        np.testing.assert_allclose(cameras[8 * k].frame, wanted.frame, atol=1e-9)
    for k in range(len(keys) - 1):
        low = np.minimum(eyes[k], eyes[k + 1]) - 1e-9
        high = np.maximum(eyes[k], eyes[k + 1]) + 1e-9
        between = np.array([c.eye_mm for c in cameras[8 * k : 8 * k + 9]])
        assert np.all((between >= low) & (between <= high))
    assert cameras[0].projection == VIEW.to_camera().projection


def test_it_turns_at_constant_speed() -> None:
    keys = (PathKey(0, (0, 0, 0), (0, 1, 0)), PathKey(2, (0, 0, 0), (1, 0, 0)))
    path = CameraPath("paravol.camera-path/1", keys)
    views = views_along(path, VIEW, np.linspace(0, 2, 7))
    forward = np.array([view.to_camera().frame[3] for view in views])
    angle = np.degrees(np.arctan2(forward[:, 0], forward[:, 1]))
    np.testing.assert_allclose(angle, np.linspace(0, 90, 7), atol=1e-6)


def key(time_s: float, **more: Any) -> dict[str, Any]:
    return {"time_s": time_s, "eye_mm": [0, 0, 0], "target_mm": [0, 1, 0]} | more


@pytest.mark.parametrize(
    ("keys", "complaint"),
    [
        ([key(0)], "keys must be a list of at least 2 entries"),
        ([key(0), key(0)], "its times must rise, and 0 s follows 0 s"),
        ([key(0), key(1, speed=3)], r"'speed' is not known in keys\[1\]"),
        ([key(0), key(1, target_mm=[0, 0, 0])], "points coincide"),
        ([key(0), {"time_s": 1, "eye_mm": [0, 0, 0]}], "either axes or target_mm"),
        ([key(-1), key(1)], r"keys\[0\]\.time_s must be a number, at least 0, got -1"),
    ],
)
def test_what_is_wrong_is_refused(
    tmp_path: Path, keys: list[dict[str, Any]], complaint: str
) -> None:
    file = tmp_path / "p.json"
    file.write_text(json.dumps({"schema": "paravol.camera-path/1", "keys": keys}))
    with pytest.raises(ValueError, match=complaint):
        load_camera_path(file)


def test_a_camera_that_turns_downwards_does_not_spin(tmp_path: Path) -> None:
    """At the key that looks along up, right stays as it was before."""
    ways = ((0, 1, 0), (0, 1, -1), (0, 0, -1))
    keys = [
        {"time_s": k, "eye_mm": [0, 0, 0], "target_mm": way}
        for k, way in enumerate(ways)
    ]
    file = tmp_path / "p.json"
    file.write_text(json.dumps({"schema": "paravol.camera-path/1", "keys": keys}))
    with pytest.warns(UpWarning, match="stays on the right"):
        path = load_camera_path(file)
    with pytest.warns(UpWarning):
        views = views_along(path, VIEW, np.linspace(0, 2, 9))
    for view in views:
        np.testing.assert_allclose(view.to_camera().frame[1], [1, 0, 0], atol=1e-12)
