"""A camera that moves: keys in a file, and the poses between them.

``{"schema": "paravol.camera-path/1", "keys": [{"time_s": 0, "eye_mm": [x, y, z],
"target_mm": [x, y, z]}, ...]}``. The eye goes along piecewise cubics that never swing
out beyond two keys (monotone in each coordinate: Fritsch and Carlson, SIAM J Numer Anal
1980;17:238), so that it stays in a narrow passage; the axes turn at constant speed from
key to key.
"""

from itertools import pairwise
from pathlib import Path
from typing import Annotated, Literal

import msgspec
import numpy as np
from msgspec import Meta, Struct
from numpy.typing import NDArray

from paravol.snapshots.view_file import ViewCamera, ViewFile, decoded
from renderers.snapshots.request import Axis, Point
from system import UserError


class PathKey(Struct, frozen=True, forbid_unknown_fields=True):
    """Place the camera at a time, as in `ViewCamera`."""

    time_s: Annotated[float, Meta(ge=0, le=86_400)]
    eye_mm: Point
    target_mm: Point | None = None
    up: Point | None = None
    axes: tuple[Axis, Axis, Axis] | None = None


class CameraPath(Struct, frozen=True, forbid_unknown_fields=True):
    """A camera's keys, in the order of their times."""

    schema: Literal["paravol.camera-path/1"]
    keys: Annotated[tuple[PathKey, ...], Meta(min_length=2, max_length=10_000)]

    @property
    def span_s(self) -> tuple[float, float]:
        """Return the times of the first and the last key."""
        return self.keys[0].time_s, self.keys[-1].time_s


def load_camera_path(path: Path) -> CameraPath:
    """Read a camera path; UserError in one sentence."""
    found = decoded(path, CameraPath, "camera path")
    times = [key.time_s for key in found.keys]
    for before, after in pairwise(times):
        if not after > before:
            raise UserError(
                f"The camera path {path} is not valid: its times must rise, and "
                f"{after:g} s follows {before:g} s."
            )
    try:
        _frames(found)
    except ValueError as error:
        raise UserError(f"The camera path {path} is not valid: {error}") from error
    return found


def views_along(
    path: CameraPath, view: ViewFile, times_s: NDArray[np.float64]
) -> list[ViewFile]:
    """Move a view's camera along a path; at the times of keys it stands on them."""
    from scipy.interpolate import PchipInterpolator
    from scipy.spatial.transform import Rotation, Slerp

    at = np.array([key.time_s for key in path.keys])
    frames = _frames(path)
    # it divides by slopes, which may be as small as numbers get: then they are none
    with np.errstate(over="ignore"):
        eyes = PchipInterpolator(at, frames[:, 0])(times_s)
    # rows right, up, forward are a left-handed triple: turn right about
    turns = Rotation.from_matrix(frames[:, 1:] * np.array([-1.0, 1, 1])[:, None])
    axes = Slerp(at, turns)(times_s).as_matrix() * np.array([-1.0, 1, 1])[:, None]
    camera = view.to_camera()
    return [
        msgspec.structs.replace(
            view,
            camera=ViewCamera.of(camera.moved(np.vstack([eye, frame]))),
        )
        for eye, frame in zip(eyes, axes, strict=True)
    ]


def _frames(path: CameraPath) -> NDArray[np.float64]:
    """Return ``(n, 4, 3)`` eye, right, up and forward of all keys.

    Where a key's up is parallel to its view, right stays as it was at the key before.
    """
    frames: list[NDArray[np.float64]] = []
    for key in path.keys:
        placed = ViewCamera(key.eye_mm, 1.0, key.axes, key.target_mm, key.up)
        before = frames[-1][1] if frames else None
        frames.append(placed.camera((8, 8), before).frame)
    return np.array(frames)
