"""Tubes of one width along a smooth chain of arcs, with exact distances.

Where the tube is narrower than its bends, the way to its wall goes straight away from
its middle line. The last piece ends in half a ball.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from system import UserError

Doubles = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Arc:
    """A part of a circle.

    start: ``(3,)`` mm. along: unit direction there. inwards: unit direction to the
    circle's middle. bend_mm: the circle's radius, infinite for a straight line.
    length_mm: along the arc.
    """

    start: Doubles
    along: Doubles
    inwards: Doubles
    bend_mm: float
    length_mm: float

    def at(self, way_mm: float) -> tuple[Doubles, Doubles]:
        """Return place and unit direction ``(3,)`` after a way along the arc."""
        if math.isinf(self.bend_mm):
            return self.start + way_mm * self.along, self.along
        turn = way_mm / self.bend_mm
        aside = self.bend_mm * (1.0 - math.cos(turn)) * self.inwards
        place = self.start + self.bend_mm * math.sin(turn) * self.along + aside
        return place, math.cos(turn) * self.along + math.sin(turn) * self.inwards

    def nearest_way_mm(self, places: Doubles) -> Doubles:
        """Return how far along the arc it is nearest to ``(..., 3)`` places, mm."""
        away = places - self.start
        along = away @ self.along
        if math.isinf(self.bend_mm):
            return np.clip(along, 0.0, self.length_mm)
        turn = np.arctan2(along, self.bend_mm - away @ self.inwards)
        way = turn * self.bend_mm
        # beyond both ends the nearer one: opposite the arc's middle they change over
        opposite = self.length_mm / 2 - math.pi * self.bend_mm
        way = np.where(way < opposite, way + 2 * math.pi * self.bend_mm, way)
        return np.clip(way, 0.0, self.length_mm)

    def middles(self, ways_mm: Doubles) -> Doubles:
        """Return the places ``(..., 3)`` after ways along the arc."""
        ways = ways_mm[..., None]
        if math.isinf(self.bend_mm):
            straight: Doubles = self.start + ways * self.along
            return straight
        turn = ways / self.bend_mm
        bent: Doubles = self.start + self.bend_mm * (
            np.sin(turn) * self.along + (1.0 - np.cos(turn)) * self.inwards
        )
        return bent


@dataclass(frozen=True, slots=True)
class TubeSpace:
    """A tube: its arcs, each going on where and as the last one ends."""

    arcs: tuple[Arc, ...]
    radius_mm: float

    def __post_init__(self) -> None:
        tightest = min(arc.bend_mm for arc in self.arcs)
        if tightest <= self.radius_mm:
            raise UserError(
                f"A tube of radius {self.radius_mm:g} mm cannot bend as tightly as "
                f"{tightest:g} mm; bend it less."
            )

    @property
    def length_mm(self) -> float:
        """Return the length of the middle line."""
        return sum(arc.length_mm for arc in self.arcs)

    def at(self, way_mm: float) -> tuple[Doubles, Doubles]:
        """Return place and unit direction of the middle line after a way along it."""
        for arc in self.arcs[:-1]:
            if way_mm <= arc.length_mm:
                return arc.at(way_mm)
            way_mm -= arc.length_mm
        return self.arcs[-1].at(way_mm)

    def distance_mm(self, x: Doubles, y: Doubles, z: Doubles) -> Doubles:
        """Return the signed distance to the wall, mm, negative in air.

        x, y, z: mm; they are broadcast.
        """
        middle, _ = self.nearest(_joined(x, y, z))
        away: Doubles = np.linalg.norm(_joined(x, y, z) - middle, axis=-1)
        return away - self.radius_mm

    def nearest(self, places: Doubles) -> tuple[Doubles, Doubles]:
        """Return the nearest of the middle line, ``(..., 3)``, and the way to it."""
        best = np.full(places.shape[:-1], np.inf)
        middle, way = np.zeros(places.shape), np.zeros(best.shape)
        before = 0.0
        for arc in self.arcs:
            along = arc.nearest_way_mm(places)
            found = arc.middles(along)
            apart = np.linalg.norm(places - found, axis=-1)
            nearer = apart < best
            best[nearer] = apart[nearer]
            middle[nearer] = found[nearer]
            way[nearer] = before + along[nearer]
            before += arc.length_mm
        return middle, way


def chain(
    start: Sequence[float], pieces: Sequence[tuple[float, float, float]]
) -> tuple[Arc, ...]:
    """Join arcs smoothly, beginning along +y.

    pieces: of each arc its length and bend, mm, and
    the direction that it bends to, in degrees about the way on from patient left
    towards up.
    """
    place, way = np.array(start, np.float64), np.array([0.0, 1.0, 0.0])
    arcs = []
    for length_mm, bend_mm, towards_deg in pieces:
        left = np.array([1.0, 0.0, 0.0])
        left -= (left @ way) * way
        left /= np.linalg.norm(left)
        up = np.cross(left, way)
        angle = math.radians(towards_deg)
        inwards = math.cos(angle) * left + math.sin(angle) * up
        arc = Arc(place, way, inwards, bend_mm, length_mm)
        place, way = arc.at(length_mm)
        arcs.append(arc)
    return tuple(arcs)


def _joined(x: Doubles, y: Doubles, z: Doubles) -> Doubles:
    return np.stack(np.broadcast_arrays(x, y, z), axis=-1)
