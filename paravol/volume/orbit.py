"""A camera that is turned about a place: by a mouse, or by keys."""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from paravol.slices.side_letters import looks_towards
from renderers.scene import Camera, Projection, Volume

STEEPEST_DEG = 85.0
"""Above it "up" would turn over."""

FILLED = 0.8
"""Share of a volume's half diagonal that a picture shows: its corners hold air."""

NEAREST_MM, FARTHEST_MM = 5.0, 2000.0


@dataclass(frozen=True, slots=True)
class Orbit:
    """Stand round a place and look at it; the patient's head is up.

    centre_mm: ``(3,)`` LPS. azimuth_deg: 0 before the face, 90 at the patient's left.
    elevation_deg: above the horizon. half_field_deg: from the middle to the edge.
    """

    centre_mm: tuple[float, float, float]
    azimuth_deg: float = 20.0
    elevation_deg: float = 8.0
    distance_mm: float = 420.0
    half_field_deg: float = 15.0

    @classmethod
    def round(cls, volume: Volume) -> "Orbit":
        """Return the orbit from which a volume fills the picture."""
        x, y, z = volume.center_mm
        lengths = np.array(volume.shape[::-1]) * volume.spacing_mm
        orbit = cls((float(x), float(y), float(z)))
        half = FILLED * float(np.linalg.norm(lengths)) / 2.0
        away = half / math.tan(math.radians(orbit.half_field_deg))
        return replace(orbit, distance_mm=min(max(away, NEAREST_MM), FARTHEST_MM))

    def turned(self, right_deg: float, up_deg: float) -> "Orbit":
        """Return the orbit turned; the elevation stops before the poles."""
        elevation = min(max(self.elevation_deg + up_deg, -STEEPEST_DEG), STEEPEST_DEG)
        return replace(
            self,
            azimuth_deg=math.remainder(self.azimuth_deg + right_deg, 360.0),
            elevation_deg=elevation,
        )

    def nearer(self, factor: float) -> "Orbit":
        """Return the orbit with its distance divided."""
        distance = min(max(self.distance_mm / factor, NEAREST_MM), FARTHEST_MM)
        return replace(self, distance_mm=distance)

    def shifted(self, right: float, up: float) -> "Orbit":
        """Return the orbit about another place, by shares of the picture's height."""
        span = 2.0 * self.distance_mm * math.tan(math.radians(self.half_field_deg))
        _, along, above = self._axes()
        x, y, z = np.array(self.centre_mm) + span * (right * along + up * above)
        return replace(self, centre_mm=(float(x), float(y), float(z)))

    def camera(self, size: tuple[int, int]) -> Camera:
        """Return the camera for a picture of ``(width, height)`` pixels."""
        outwards, _, _ = self._axes()
        centre = np.array(self.centre_mm)
        return Camera.looking_at(
            centre + self.distance_mm * outwards,
            centre,
            extent=math.radians(self.half_field_deg),
            size=size,
            projection=Projection.PERSPECTIVE,
        )

    def letters(self) -> tuple[str, str]:
        """Return the side of the patient at the picture's left and right edge.

        One of R, L, A and P: towards which the horizontal axis points most.
        """
        _, along, _ = self._axes()
        return looks_towards(-along)[0], looks_towards(along)[0]

    def _axes(self) -> tuple[NDArray[np.float64], ...]:
        """Return unit vectors to the eye, to the picture's right, and up in it."""
        turn, rise = math.radians(self.azimuth_deg), math.radians(self.elevation_deg)
        outwards = np.array(
            [
                math.cos(rise) * math.sin(turn),
                -math.cos(rise) * math.cos(turn),
                math.sin(rise),
            ]
        )
        along = np.array([math.cos(turn), math.sin(turn), 0.0])
        return outwards, along, np.cross(outwards, along)
