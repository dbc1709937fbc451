"""A camera that leaves the recorded view and flies through the air of the head."""

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderers.scene import Camera, Mesh, Volume
from renderers.scene.mesh import PlacedMesh
from scenarios import Endoscope
from scenarios.instruments.lofting import BentLine, rod

CLEAR_MM = 0.4
"""So far from every wall the eye stays."""

STEP_MM = 0.2
"""A way is gone in such steps, each of them shorter than `CLEAR_MM`: so the eye passes
through no wall, however thin."""

LONGEST_MM = 50.0
"""Of one move; a wheel that is turned wildly asks for more."""

_BESIDE_MM = 0.25
"""Half the way over which a distance's slope is read."""

_HIDDEN_MM = 0.3
"""A shaft is left out for an eye that is so near to its skin, or within."""


class CameraMove(NamedTuple):
    """Turn and move a camera: degrees about its own axes, mm along them.

    right_deg: to the right. up_deg: upwards. roll_deg: of the picture, clockwise.
    """

    right_deg: float = 0.0
    up_deg: float = 0.0
    roll_deg: float = 0.0
    right_mm: float = 0.0
    up_mm: float = 0.0
    ahead_mm: float = 0.0

    def then(self, other: "CameraMove") -> "CameraMove":
        """Return both in one; small turns may be added up."""
        return CameraMove(*(a + b for a, b in zip(self, other, strict=True)))


@dataclass(frozen=True, slots=True)
class FreeCamera:
    """Where somebody looks from.

    frame: ``(4, 3)`` rows eye (mm), right, up, forward (unit), LPS.
    """

    frame: NDArray[np.float64]

    def moved(self, move: CameraMove, distance: Volume) -> "FreeCamera":
        """Return the camera after a move; the eye stays in the air, or slides along.

        distance: signed, mm, negative in air; outside of it nothing stops the eye.
        """
        eye, axes = self.frame[0], self.frame[1:]
        turn = (
            _turn(0, move.up_deg) @ _turn(1, move.right_deg) @ _turn(2, move.roll_deg)
        )
        axes = turn @ axes
        # rounding must not add up over a thousand small turns
        left, _, right = np.linalg.svd(axes)
        axes = left @ right
        way = np.array([move.right_mm, move.up_mm, move.ahead_mm]) @ axes
        length_mm = float(np.linalg.norm(way))
        if length_mm > LONGEST_MM:
            way *= LONGEST_MM / length_mm
            length_mm = LONGEST_MM
        count = int(np.ceil(length_mm / STEP_MM))
        for _ in range(count):
            eye = _in_air(eye + way / count, distance)
        return FreeCamera(np.vstack([eye, axes]))

    def camera(self, like: Camera) -> Camera:
        """Return the camera with the lens and the size of another one."""
        return Camera(
            self.frame,
            like.extent,
            like.width,
            like.height,
            like.projection,
            like.distortion,
        )


def _turn(axis: int, angle_deg: float) -> NDArray[np.float64]:
    """Return a turn of the rows right, up and forward about one of them."""
    angle = np.radians(angle_deg)
    cosine, sine = np.cos(angle), np.sin(angle)
    turn = np.eye(3)
    # upwards: forward to up; to the right: forward to right; clockwise: up to right
    first, second = ((2, 1), (2, 0), (1, 0))[axis]
    turn[first, first] = turn[second, second] = cosine
    turn[first, second], turn[second, first] = sine, -sine
    return turn


def _in_air(eye: NDArray[np.float64], distance: Volume) -> NDArray[np.float64]:
    """Return a place, pushed out of the wall that it is too near to."""
    voxel = distance.voxel_from_world[:3, :3] @ eye + distance.voxel_from_world[:3, 3]
    top = np.array(distance.shape[::-1]) - 1
    if not np.all((voxel >= 1.0) & (voxel <= top - 1.0)):
        return eye
    beside = _BESIDE_MM * np.concatenate([np.zeros((1, 3)), np.eye(3), -np.eye(3)])
    found = distance.sample(eye + beside)
    slope = found[1:4] - found[4:7]
    rise = float(np.linalg.norm(slope))
    if found[0] <= -CLEAR_MM or rise == 0.0:
        return eye
    pushed: NDArray[np.float64] = eye - (found[0] + CLEAR_MM) * slope / rise
    return pushed


def shaft_in_scene(
    scope: Endoscope,
    world_from_tip: NDArray[np.float64],
    eye_mm: NDArray[np.float64],
) -> list[PlacedMesh]:
    """Return a scope's shaft as it stands in the scene; none for an eye within it."""
    radius_mm = scope.diameter_mm / 2.0
    tip, back = world_from_tip[:3, 3], world_from_tip[:3, 2]
    along = float(np.clip((eye_mm - tip) @ back, 0.0, scope.shaft_length_mm))
    if float(np.linalg.norm(eye_mm - tip - along * back)) < radius_mm + _HIDDEN_MM:
        return []
    return [(_shaft(radius_mm, scope.shaft_length_mm), world_from_tip)]


@lru_cache(maxsize=4)
def _shaft(radius_mm: float, length_mm: float) -> Mesh:
    """Build a round rod from its tip at the origin along +z."""
    return rod(BentLine(), 0.0, length_mm, (radius_mm, radius_mm))
