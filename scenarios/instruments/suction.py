"""Tubes: suctions, and the microdebrider with its window."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderers.scene import Material, Mesh
from scenarios.instruments.lofting import SIDES, BentLine, rings, section, skin
from scenarios.instruments.parts import Capsules, InstrumentPart, Shape, shaded
from system import UserError

Doubles = NDArray[np.float64]

_INSET = 0.7
"""How far within an open end its capsule's middle lies, in radii: its rim stands out
of the ball there, and the ball out of the bore."""

_BLUNT, _FRONT = 0.6, 0.8
"""Length of a debrider's round end, and how far within its capsule's middle lies, in
radii: it is blunter than a ball."""

_CORNER_MM = 1.3
"""Length of the round ends of its window."""

_EDGE_MM = 0.15
"""Width of its bevelled edge."""


def suction_tube(
    outer_mm: float = 2.4,
    bore_mm: float = 1.6,
    length_mm: float = 130.0,
    bend_start_mm: float = 70.0,
    bend_deg: float = 25.0,
) -> Mesh:
    """Build a Frazier suction: an open steel tube, straight at the tip, bent behind.

    Mesh frame: origin at the centre of the open tip, +z back up the shaft; the bend
    turns towards +y. Sizes of a 7 French (2.4 mm) tube.
    """
    _require_bore(outer_mm, bore_mm)
    if not 0 < bend_start_mm < length_mm:
        raise UserError(
            f"the bend must start within the {length_mm} mm tube, got {bend_start_mm}"
        )
    stations = np.concatenate(
        [[bend_start_mm], np.linspace(bend_start_mm, length_mm, 24)[1:]]
    )
    profile = _wall(outer_mm / 2, bore_mm / 2, stations)
    angles = np.linspace(0.0, 2 * np.pi, SIDES + 1)[:-1]
    radius, height = np.tile(profile, (SIDES, 1)).T
    vertices = np.repeat(np.stack([np.cos(angles), np.sin(angles)], 1), len(profile), 0)
    vertices = np.column_stack([vertices * radius[:, None], height])
    # neighbours on the profile and round the tube
    here = np.arange(len(vertices)).reshape(SIDES, -1)
    ahead, beside = np.roll(here, -1, axis=1), np.roll(here, -1, axis=0)
    across = np.roll(beside, -1, axis=1)
    faces = np.stack([ahead, beside, here, across, beside, ahead], axis=-1)
    return Mesh(
        _bend(vertices, bend_start_mm, length_mm, bend_deg),
        faces.reshape(-1, 3).astype(np.int32),
        Material.METAL,
    )


def _require_bore(outer_mm: float, bore_mm: float) -> None:
    if not 0 < bore_mm < outer_mm:
        raise UserError(f"a bore of {bore_mm} mm does not fit a {outer_mm} mm tube")


def _wall(outer: float, bore: float, stations: Doubles) -> Doubles:
    """Return the closed outline ``(n, 2)`` of a tube's wall: radius and length, mm."""
    rim = (outer - bore) / 2
    # A half-round rim: a sharp one would glint as a polygon.
    angles = np.linspace(0.0, np.pi, 9)
    lip = np.stack(
        [outer - rim + rim * np.cos(angles), rim - rim * np.sin(angles)], axis=1
    )
    outside = np.stack([np.full(len(stations), outer), stations], axis=1)[::-1]
    inside = np.stack([np.full(len(stations), bore), stations], axis=1)
    return np.concatenate([outside, lip, inside])


def _bend(
    vertices: Doubles, start_mm: float, end_mm: float, angle_deg: float
) -> Doubles:
    """Turn everything beyond `start_mm` along a circular arc in the y-z plane."""
    total = np.radians(angle_deg)
    if total == 0.0:
        return vertices
    radius = (end_mm - start_mm) / total
    turn = np.clip((vertices[:, 2] - start_mm) / radius, 0.0, total)
    bent = vertices.copy()
    arm = radius - vertices[:, 1]
    behind = vertices[:, 2] > start_mm
    bent[behind, 1] = (radius - arm * np.cos(turn))[behind]
    bent[behind, 2] = (start_mm + arm * np.sin(turn))[behind]
    return bent


@dataclass(frozen=True, slots=True)
class Frazier(Shape):
    """Describe the suction whose handle is bent away from the view, mm."""

    outer_mm: float = 2.4
    bore_mm: float = 1.6
    length_mm: float = 130.0
    bend_start_mm: float = 70.0
    bend_deg: float = 25.0

    def parts(self) -> tuple[InstrumentPart, ...]:
        """Return the tube."""
        begin, end = self.bend_start_mm, self.length_mm
        mesh = suction_tube(self.outer_mm, self.bore_mm, end, begin, self.bend_deg)
        radius = self.outer_mm / 2
        lengths = np.append(_INSET * radius, np.linspace(begin, end, 6))
        middle = np.zeros((len(lengths), 3))
        middle[:, 2] = lengths
        middle = _bend(middle, begin, end, self.bend_deg)
        return (InstrumentPart(mesh, Capsules.along(middle, radius)),)

    def tip(self) -> tuple[Doubles, float]:
        """Return the ball in its mouth."""
        return np.array([0.0, 0.0, _INSET * self.outer_mm / 2]), self.outer_mm / 2


@dataclass(frozen=True, slots=True)
class CurvedSuction(Shape):
    """Describe a suction whose mouth is bent, mm."""

    outer_mm: float = 3.0
    bore_mm: float = 2.2
    length_mm: float = 130.0
    straight_mm: float = 3.0
    radius_mm: float = 9.0
    turn_deg: float = 60.0

    def line(self) -> BentLine:
        """Return its middle."""
        return BentLine(self.straight_mm, self.radius_mm, self.turn_deg)

    def parts(self) -> tuple[InstrumentPart, ...]:
        """Return the tube."""
        _require_bore(self.outer_mm, self.bore_mm)
        line = self.line()
        outer = self.outer_mm / 2
        wall = _wall(outer, self.bore_mm / 2, line.stations(outer, self.length_mm))
        half = np.repeat(wall[:, :1], 2, axis=1)
        mesh = skin(rings(line, wall[:, 1], half, section(SIDES)), closed=True)
        lengths = line.stations(_INSET * outer, self.length_mm)
        middle = line.at(lengths[[0, *range(1, len(lengths) - 1, 2), -1]])
        caster = line.bend(_INSET * outer, self.length_mm)
        mesh = shaded(mesh, Capsules.along(caster, outer))
        return (InstrumentPart(mesh, Capsules.along(middle, outer)),)

    def tip(self) -> tuple[Doubles, float]:
        """Return the ball in its mouth."""
        return self.line().at(_INSET * self.outer_mm / 2)[0], self.outer_mm / 2

    def end(self, length_mm: float) -> Capsules:
        """Return two chords of the bend."""
        line = BentLine(self.straight_mm, self.radius_mm, self.turn_deg)
        outer = self.outer_mm / 2
        lengths = _INSET * outer + np.array([0.0, 0.5, 1.0]) * length_mm
        return Capsules.along(line.at(lengths), outer)


@dataclass(frozen=True, slots=True)
class Debrider(Shape):
    """Describe a straight microdebrider blade: a closed tube with a side window, mm.

    The window faces +y. Within it tissue is sucked in and cut off.
    """

    outer_mm: float = 4.0
    length_mm: float = 120.0
    window_mm: float = 10.0
    window_deg: float = 96.0
    window_begin_mm: float = 1.6
    depth_mm: float = 1.5
    bulge_mm: float = 0.45

    def parts(self) -> tuple[InstrumentPart, ...]:
        """Return the tube; the window is a hollow with the inner blade as its floor."""
        radius = self.outer_mm / 2
        begin, end = self.window_begin_mm, self.window_begin_mm + self.window_mm
        dome = np.radians(np.array([12.0, 30.0, 48.0, 68.0]))
        edge = np.array([0.0, _EDGE_MM, 0.4, 0.8])
        angles = self._angles()
        beside = radius * (angles - math.pi / 2)
        # the window's ends are round: its stations follow them
        across = np.minimum(np.abs(beside) / self._half_arc(), 1.0)
        short = _CORNER_MM * (1.0 - np.sqrt(1.0 - 0.98 * across**2))
        first, last = begin + short, end - short
        inner = np.linspace(first + 1.0, last - 1.0, 8)
        front = _BLUNT * radius * (1.0 - np.cos(np.append(dome, math.pi / 2)))
        fixed = np.append(front, [end + 0.5, self.length_mm])
        lengths = np.concatenate(
            [
                np.broadcast_to(fixed[:5, None], (5, len(angles))),
                first + edge[:, None],
                inner,
                last - edge[::-1, None],
                np.broadcast_to(fixed[5:, None], (2, len(angles))),
            ]
        )
        scale = np.append(np.sin(dome), np.ones(len(lengths) - len(dome)))[:, None]
        within = np.minimum(lengths - first, last - lengths)
        within = np.minimum(within, self._half_arc() - np.abs(beside))
        open_share = np.clip(within / _EDGE_MM, 0.0, 1.0)
        floor = (radius - self.depth_mm) / np.maximum(np.sin(angles), 0.3)
        distance = radius * scale
        distance = distance + (np.minimum(floor, distance) - distance) * open_share
        rows = np.stack(
            [distance * np.cos(angles), distance * np.sin(angles), lengths], axis=-1
        )
        tube = np.array([[0.0, 0.0, _FRONT * radius], [0.0, 0.0, self.length_mm]])
        capsules = Capsules.along(tube, radius)
        return (InstrumentPart(shaded(skin(rows), capsules), capsules),)

    def _angles(self) -> Doubles:
        """Return places round the tube, close together at the window's sides."""
        half, radius = self._half_arc(), self.outer_mm / 2
        edge = half - np.array([0.0, _EDGE_MM, 0.4, 0.8])
        inner = np.linspace(-edge[-1], edge[-1], 7)[1:-1]
        arc = np.concatenate([-edge, inner, edge[::-1]]) / radius
        around = np.linspace(half / radius, 2 * math.pi - half / radius, 22)[1:-1]
        return math.pi / 2 + np.concatenate([arc, around])

    def _half_arc(self) -> float:
        """Return half the window's width round the tube, mm."""
        return self.outer_mm / 2 * math.radians(self.window_deg / 2)

    def tip(self) -> tuple[Doubles, float]:
        """Return the ball at its round end."""
        radius = self.outer_mm / 2
        return np.array([0.0, 0.0, _FRONT * radius]), radius

    def edge(self) -> tuple[Doubles, float]:
        """Return what bulges into the window: a line to and fro along it."""
        radius, bulge = self.outer_mm / 2, self.bulge_mm
        begin = self.window_begin_mm + 2 * bulge
        end = self.window_begin_mm + self.window_mm - 2 * bulge
        # its balls touch the tube, where the tube's capsule is
        out = radius + bulge
        angles = math.pi / 2 + np.array([-0.6, 0.0, 0.6]) * self._half_arc() / radius
        angles = np.repeat(angles, 2)
        lengths = np.array([begin, end, end, begin, begin, end])
        places = [out * np.cos(angles), out * np.sin(angles), lengths]
        return np.stack(places, axis=1), bulge
