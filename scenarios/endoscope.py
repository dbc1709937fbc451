"""A rigid endoscope: from where its tip is to what it sees.

The only place where the devices' vocabulary (a tip pose) meets the renderers' (a
camera).
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from devices.cross import cross, dot
from renderers.scene import Camera, Projection
from system import UserError

SUPERIOR = np.array([0.0, 0.0, 1.0])
ANTERIOR = np.array([0.0, -1.0, 0.0])

LEAST_GRAVITY = 0.1
"""A picture has no horizon where less of "up" than this lies in it."""

PARALLEL = 0.999
"""Cosine above which the view axis counts as parallel to "up" (2.6 degrees): the
horizon then follows the patient's front instead of flickering."""


@dataclass(frozen=True, slots=True)
class Endoscope:
    """Describe a rigid scope.

    diameter_mm: outer diameter of the shaft; sinus scopes have 4 and 2.7 mm.
    angle_deg: angle between the shaft and the view axis, towards the light post.
    field_of_view_deg: full angle of the round picture.
    ring_radius_mm: where the light fibres lie around the lens.
    """

    diameter_mm: float = 2.7
    angle_deg: float = 0.0
    field_of_view_deg: float = 80.0
    shaft_length_mm: float = 180.0
    ring_radius_mm: float = 0.95

    def __post_init__(self) -> None:
        for name, value, low, high in (
            ("diameter", self.diameter_mm, 0.5, 10.0),
            ("angle", self.angle_deg, 0.0, 90.0),
            ("field of view", self.field_of_view_deg, 20.0, 150.0),
            ("shaft length", self.shaft_length_mm, 10.0, 500.0),
            ("light ring radius", self.ring_radius_mm, 0.0, self.diameter_mm / 2),
        ):
            if not (math.isfinite(value) and low <= value <= high):
                raise UserError(
                    f"scope {name} must lie between {low:g} and {high:g}, got {value:g}"
                )

    def at(self, angle_deg: float | None) -> "Endoscope":
        """Return this scope with another angle; itself for None.

        UserError for one out of range.
        """
        if angle_deg is None or angle_deg == self.angle_deg:
            return self
        return replace(self, angle_deg=angle_deg)

    def camera(
        self,
        world_from_tip: NDArray[np.float64],
        roll_deg: float,
        size: tuple[int, int],
        camera_roll_deg: float = 0.0,
    ) -> Camera:
        """Return the camera of a tip pose, see `frame`; size: ``(width, height)``."""
        return Camera(
            self.frame(world_from_tip, roll_deg, camera_roll_deg),
            math.radians(self.field_of_view_deg / 2),
            size[0],
            size[1],
            Projection.EQUIDISTANT,
        )

    def frame(
        self,
        world_from_tip: NDArray[np.float64],
        roll_deg: float,
        camera_roll_deg: float = 0.0,
    ) -> NDArray[np.float64]:
        """Return the frame ``(4, 3)`` of the camera of a tip pose.

        world_from_tip: 4x4; +z of the tip frame runs back up the shaft. Its x and y
            axes are ignored, a five-joint arm does not measure them.
        roll_deg: turn of the light post, right-handed about the pointing direction;
            0 is upwards. Turning it moves the view of an angled scope, never the
            horizon.
        camera_roll_deg: turn of the camera head from upright, right-handed about the
            view. Turning it turns the picture, the other way round.
        """
        tip = world_from_tip[:3, 3]
        shaft = -world_from_tip[:3, 2]
        right, up = _upright(shaft)
        roll = math.radians(roll_deg)
        post = math.cos(roll) * up + math.sin(roll) * right
        tilt = math.radians(self.angle_deg)
        view = math.cos(tilt) * shaft + math.sin(tilt) * post
        view /= np.linalg.norm(view)
        right, up = _upright(view)
        if camera_roll_deg:
            turn = math.radians(camera_roll_deg)
            cosine, sine = math.cos(turn), math.sin(turn)
            right, up = cosine * right - sine * up, cosine * up + sine * right
        return np.stack([tip, right, up, view])


def tip_frame(
    tip_mm: NDArray[np.float64],
    pointing: NDArray[np.float64],
    roll_deg: float = 0.0,
) -> NDArray[np.float64]:
    """Build ``world_from_tip`` (4x4) of a tool at `tip_mm` pointing along `pointing`.

    roll_deg: turn of the frame, right-handed about the pointing direction. At 0 x and y
    are the upright ones, so that a picture of a tool without a roll sensor stays still;
    y, which jaws and windows face, is then upwards.
    """
    z = -np.asarray(pointing, dtype=np.float64)
    z = z / math.sqrt(dot(z, z))
    right, _ = _upright(-z)
    frame = np.eye(4)
    frame[:3, 0], frame[:3, 1], frame[:3, 2] = right, cross(z, right), z
    if roll_deg:
        turn = math.radians(roll_deg)
        cosine, sine = math.cos(turn), math.sin(turn)
        x, y = frame[:3, :2].T.copy()
        frame[:3, 0], frame[:3, 1] = cosine * x - sine * y, cosine * y + sine * x
    frame[:3, 3] = tip_mm
    return frame


def _upright(
    axis: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return unit right and up of a picture along `axis`, nearest to upright."""
    reference = SUPERIOR if abs(axis @ SUPERIOR) < PARALLEL else ANTERIOR
    right = cross(axis, reference)
    right /= math.sqrt(dot(right, right))
    return right, cross(right, axis)
