"""What an abstract space is made of: walls, hoops in the air, signs and stripes."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from anatomy.abstract.boxes import BoxSpace
from anatomy.abstract.signs import Sign
from anatomy.abstract.tubes import TubeSpace

Doubles = NDArray[np.float64]

WIRE_MM = 0.75
"""Half the thickness of a hoop's wire: less would be lost between voxels of 0.5 mm."""

SCOPE_MM = 2.0
"""Radius of the thickest scope that every place is open to."""

MARGIN_MM = 0.4
"""Air that is left around it."""

PAST_MM = 3.0
"""A scope can be pushed so far through a hoop."""

_STEP_MM = 0.25


@dataclass(frozen=True, slots=True)
class Hoop:
    """A ring of wire.

    middle: ``(3,)`` mm. axis: unit, the direction that it is passed in. radius_mm: of
    the wire's middle line.
    """

    middle: Doubles
    axis: Doubles
    radius_mm: float

    @property
    def opening_mm(self) -> float:
        """Return the radius of the hole."""
        return self.radius_mm - WIRE_MM

    def depth_mm(self, x: Doubles, y: Doubles, z: Doubles) -> Doubles:
        """Return the signed distance to the wire's surface, mm, positive in the wire.

        x, y, z: mm; they are broadcast.
        """
        a, b, c = x - self.middle[0], y - self.middle[1], z - self.middle[2]
        along = a * self.axis[0] + b * self.axis[1] + c * self.axis[2]
        across = np.sqrt(np.maximum(a * a + b * b + c * c - along * along, 0.0))
        depth: Doubles = WIRE_MM - np.hypot(across - self.radius_mm, along)
        return depth


def no_stripes(places: Doubles) -> Doubles:
    """Paint nothing."""
    return np.zeros(len(places))


@dataclass(frozen=True, slots=True)
class Layout:
    """Describe a space; patient LPS, mm.

    low, high: ``(3,)`` corners of what is built. pivot: where the scope enters, along
    +y. stripes: gives the share of dark paint on the walls at ``(n, 3)`` places.
    landmarks: ``(3,)`` by name. Hoops touch neither each other nor the walls.
    """

    wall: BoxSpace | TubeSpace
    low: Doubles
    high: Doubles
    pivot: Doubles
    landmarks: dict[str, Doubles]
    hoops: tuple[Hoop, ...] = ()
    signs: tuple[Sign, ...] = ()
    stripes: Callable[[Doubles], Doubles] = field(default=no_stripes)

    def distance_mm(self, x: Doubles, y: Doubles, z: Doubles) -> Doubles:
        """Return the signed distance to the air's surface, mm, negative in air.

        x, y, z: mm; they are broadcast.
        """
        signed = self.wall.distance_mm(x, y, z)
        for hoop in self.hoops:
            signed = np.maximum(signed, hoop.depth_mm(x, y, z))
        return signed

    def is_open_to(self, place: Doubles, past_mm: float = 0.0) -> bool:
        """Return whether the thickest scope fits from the pivot to a place.

        past_mm: it goes on so far behind it.
        """
        way = place - self.pivot
        length = float(np.linalg.norm(way))
        count = int((length + past_mm) / _STEP_MM)
        along = self.pivot + np.linspace(0, 1 + past_mm / length, count)[:, None] * way
        air = self.distance_mm(*along.T)
        return bool(air.max() < -SCOPE_MM - MARGIN_MM)
