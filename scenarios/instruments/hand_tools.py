"""Tools without jaws that take or feel where they move: curette, knife, elevator."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderers.scene import Mesh
from scenarios.instruments.lofting import (
    SIDES,
    BentLine,
    eased,
    joined,
    rings,
    section,
    skin,
)
from scenarios.instruments.parts import Capsules, InstrumentPart, Shape, shaded

Doubles = NDArray[np.float64]

_DOME = np.radians([15.0, 35.0, 60.0, 90.0])


def _side_by_side(strands: list[Doubles], radius_mm: Doubles) -> Capsules:
    """Return the capsules of a blade that becomes a round shaft.

    strands: places ``(n, 3)``, which meet where the shaft begins. radius_mm: ``(n,)``.
    """
    between = (radius_mm[:-1] + radius_mm[1:]) / 2
    first = strands[0]
    held = [Capsules.along(first, between)]
    for strand in strands[1:]:
        apart = np.linalg.norm(strand - first, axis=1) > 1e-9
        last = int(np.flatnonzero(apart).max(initial=-1)) + 2
        if last > 1:
            held.append(Capsules.along(strand[:last], between[: last - 1]))
    return Capsules.joined(held)


def _bladed(mesh: Mesh, strands: list[Doubles], radius_mm: Doubles) -> InstrumentPart:
    """Return a blade as a part; five capsules are enough for its shadow."""
    count = len(radius_mm)
    some = [1, count // 2, count - 2, count - 1]
    two = [strand[some] for strand in (strands[1], strands[-2])]
    caster = _side_by_side(two, radius_mm[some])
    return InstrumentPart(shaded(mesh, caster), _side_by_side(strands, radius_mm))


@dataclass(frozen=True, slots=True)
class Curette(Shape):
    """Describe a ring curette, mm: a sharp ring across the tool's y axis.

    ring_mm: outer diameter. wire_mm: thickness of the ring.
    """

    ring_mm: float = 4.0
    wire_mm: float = 0.9
    shaft_mm: float = 2.4
    neck_mm: float = 14.0
    length_mm: float = 130.0

    def _ring(self, count: int) -> Doubles:
        """Return places ``(count, 3)`` on the ring's middle, from its end round."""
        angles = np.arange(count) * (2 * math.pi / count)
        radius = (self.ring_mm - self.wire_mm) / 2
        x, z = radius * np.sin(angles), self.ring_mm / 2 - radius * np.cos(angles)
        return np.stack([x, np.zeros(count), z], axis=1)

    def parts(self) -> tuple[InstrumentPart, ...]:
        """Return ring, neck and shaft in one."""
        line = BentLine()
        around = np.arange(12) * (2 * math.pi / 12)
        half = self.wire_mm / 2
        middle = self._ring(40)
        outwards = middle - np.array([0.0, 0.0, self.ring_mm / 2])
        outwards /= np.linalg.norm(outwards, axis=1, keepdims=True)
        rows = (
            middle[:, None]
            + half * np.cos(around)[:, None] * outwards[:, None]
            + half * np.sin(around)[:, None] * np.array([0.0, 1.0, 0.0])
        )
        lengths = np.concatenate(
            [
                self.ring_mm - 0.7 * self.wire_mm + half * (1 - np.cos(_DOME)),
                np.linspace(self.ring_mm + 1.0, self.neck_mm, 6),
                [self.length_mm - 0.5, self.length_mm],
            ]
        )
        thick = self.shaft_mm / 2
        radius = np.full(len(lengths), thick)
        radius[:4] = half * np.sin(_DOME)
        share = np.linspace(0.0, 1.0, 6)
        radius[4:10] = eased(half, thick, share)
        radius[-1] = 0.6 * thick
        neck = rings(line, lengths, np.stack([radius, radius], 1), section(SIDES))
        mesh = joined(skin(rows, closed=True), skin(neck))
        ring = self._ring(16)
        stem = lengths[3:-1]
        capsules = Capsules.joined(
            [
                Capsules.along(ring[np.r_[0:16, 0]], half),
                Capsules.along(
                    line.at(stem), np.minimum(radius[3:-2], radius[4:-1]) + 0.05
                ),
            ]
        )
        ring = self._ring(5)
        stem = line.at([self.ring_mm, self.neck_mm, self.length_mm])
        caster = Capsules.joined(
            [
                Capsules.along(ring[np.r_[0:5, 0]], half),
                Capsules.along(stem, np.array([0.6, 1.0]) * thick),
            ]
        )
        return (InstrumentPart(shaded(mesh, caster), capsules),)

    def tip(self) -> tuple[Doubles, float]:
        """Return the ball that fills the ring's end."""
        return np.array([0.0, 0.0, self.wire_mm / 2]), self.wire_mm / 2

    def edge(self) -> tuple[Doubles, float]:
        """Return the ring's outer half."""
        points = self._ring(16)[np.r_[11:16, 0:6]]
        return points, self.wire_mm / 2


@dataclass(frozen=True, slots=True)
class SickleKnife(Shape):
    """Describe a sickle knife, mm: a pointed blade, curved in the y-z plane.

    height_mm, thick_mm: of the blade. Its edge is on the inner side of the curve.
    """

    blade_mm: float = 12.0
    height_mm: float = 2.0
    thick_mm: float = 0.7
    radius_mm: float = 14.0
    turn_deg: float = 45.0
    shaft_mm: float = 2.4
    length_mm: float = 130.0

    def line(self) -> BentLine:
        """Return the blade's and the shaft's middle."""
        return BentLine(0.0, self.radius_mm, self.turn_deg)

    def _lengths(self) -> Doubles:
        blade = self.blade_mm * np.array(
            [0.0, 0.02, 0.05, 0.1, 0.17, 0.25, 0.33, 0.42, 0.51, 0.6, 0.7, 0.8, 0.9]
        )
        behind = self.blade_mm + np.array([0.0, 1.0, 2.0, 3.5, 5.0])
        end = [self.length_mm - 0.5, self.length_mm]
        return np.concatenate([blade, behind, end])

    def _half(self, lengths_mm: Doubles) -> Doubles:
        """Return half the thickness (x) and height at lengths from the tip."""
        shaft = self.shaft_mm / 2
        point = np.clip(lengths_mm / (0.45 * self.blade_mm), 0.0, 1.0)
        round_mm = 0.12 + (self.height_mm / 2 - 0.12) * np.sin(point * math.pi / 2)
        thick = self.thick_mm / 2 * (0.35 + 0.65 * np.clip(point * 1.5, 0, 1))
        back = np.clip((lengths_mm - self.blade_mm) / 5.0, 0.0, 1.0)
        half = np.stack([eased(thick, shaft, back), eased(round_mm, shaft, back)], 1)
        half[lengths_mm > self.length_mm - 0.1] *= 0.6
        return half

    def parts(self) -> tuple[InstrumentPart, ...]:
        """Return blade and shaft in one."""
        line, lengths = self.line(), self._lengths()
        half = self._half(lengths)
        mesh = skin(rings(line, lengths, half, section(24)))
        lengths = np.append(
            self.blade_mm * np.array([0.01, 0.08, 0.2, 0.35, 0.5, 0.65, 0.82, 1.0]),
            [self.blade_mm + 2.5, self.blade_mm + 5.0, self.length_mm - 0.5],
        )
        half = self._half(lengths)
        radius = half.min(axis=1) + 0.05
        beside = np.maximum(half[:, 1] - radius, 0.0)
        held = [
            line.place(0.0, share * beside, lengths)
            for share in (-1.0, -0.33, 0.33, 1.0)
        ]
        return (_bladed(mesh, held, radius),)

    def tip(self) -> tuple[Doubles, float]:
        """Return the ball in its point."""
        return self.line().at(0.3)[0], 0.3

    def end(self, length_mm: float) -> Capsules:
        """Return two chords of the blade, as thick as its point."""
        lengths = 0.3 + np.array([0.0, 0.5, 1.0]) * length_mm
        return Capsules.along(self.line().at(lengths), 0.3)

    def edge(self) -> tuple[Doubles, float]:
        """Return the inner side of the blade and its point."""
        line = self.line()
        lengths = np.linspace(0.0, 0.85 * self.blade_mm, 8)
        radius = 0.25
        off = np.maximum(self._half(lengths)[:, 1] - radius, 0.0)
        return line.place(0.0, off, lengths), radius


@dataclass(frozen=True, slots=True)
class InjectionNeedle(Shape):
    """Describe a long injection needle, mm: a pointed tube, stepped to its shaft.

    needle_mm, point_mm: thickness of the needle, length of its point.
    """

    needle_mm: float = 0.9
    point_mm: float = 1.6
    reach_mm: float = 22.0
    shaft_mm: float = 2.2
    length_mm: float = 130.0

    def _profile(self) -> tuple[Doubles, Doubles]:
        """Return lengths from the tip and the radii there."""
        thin, thick = self.needle_mm / 2, self.shaft_mm / 2
        point = np.array([0.0, 0.15, 0.4, 0.7, 1.0])
        cone = self.reach_mm + np.linspace(0.0, 6.0, 5)
        lengths = np.concatenate(
            [self.point_mm * point, cone, [self.length_mm - 0.5, self.length_mm]]
        )
        radius = np.concatenate(
            [
                0.08 + (thin - 0.08) * point,
                eased(thin, thick, np.linspace(0.0, 1.0, 5)),
                [thick, 0.6 * thick],
            ]
        )
        return lengths, radius

    def parts(self) -> tuple[InstrumentPart, ...]:
        """Return point, needle and shaft in one."""
        line, (lengths, radius) = BentLine(), self._profile()
        mesh = skin(rings(line, lengths, np.stack([radius, radius], 1), section(24)))
        stem = lengths[1:-1]
        thick = radius[1:-1]
        capsules = Capsules.along(
            line.at(stem), np.minimum(thick[:-1], thick[1:]) + 0.05
        )
        return (InstrumentPart(mesh, capsules),)

    def tip(self) -> tuple[Doubles, float]:
        """Return the ball in its point."""
        return np.array([0.0, 0.0, 0.3]), 0.15


@dataclass(frozen=True, slots=True)
class BallProbe(Shape):
    """Describe an ostium seeker, mm: a ball on a thin bent rod."""

    ball_mm: float = 2.0
    rod_mm: float = 1.2
    straight_mm: float = 4.0
    radius_mm: float = 7.0
    turn_deg: float = 45.0
    shaft_mm: float = 2.2
    length_mm: float = 130.0

    def line(self) -> BentLine:
        """Return its middle."""
        return BentLine(self.straight_mm, self.radius_mm, self.turn_deg)

    def parts(self) -> tuple[InstrumentPart, ...]:
        """Return ball, rod and shaft in one."""
        line, ball, thin = self.line(), self.ball_mm / 2, self.rod_mm / 2
        thick = self.shaft_mm / 2
        angles = np.radians([10, 25, 42, 60, 78, 96, 114, 130])
        angles = np.append(angles, math.pi - math.asin(0.98 * thin / ball))
        front = ball * (1 - np.cos(angles))
        bend = self.straight_mm + self.radius_mm * math.radians(self.turn_deg)
        rest = line.stations(ball * 2 + 0.3, bend + 2.0)
        cone = bend + np.linspace(2.5, 12.0, 5)
        lengths = np.concatenate(
            [front, rest, cone, [self.length_mm - 0.5, self.length_mm]]
        )
        radius = np.full(len(lengths), thin)
        radius[: len(front)] = ball * np.sin(angles)
        share = np.linspace(0.0, 1.0, 5)
        first = len(front) + len(rest)
        radius[first : first + 5] = eased(thin, thick, share)
        radius[-2:] = thick, 0.6 * thick
        mesh = skin(rings(line, lengths, np.stack([radius, radius], 1), section(24)))
        chosen = lengths[len(front) : -1]
        taper = radius[len(front) : -1]
        capsules = Capsules.joined(
            [
                Capsules.along(line.at([ball, ball + 1e-3]), ball),
                Capsules.along(
                    line.at(chosen), np.minimum(taper[:-1], taper[1:]) + 0.03
                ),
            ]
        )
        return (InstrumentPart(mesh, capsules),)

    def tip(self) -> tuple[Doubles, float]:
        """Return its ball."""
        return self.line().at(self.ball_mm / 2)[0], self.ball_mm / 2

    def end(self, length_mm: float) -> Capsules:
        """Return the ball, and the thin rod behind it as one chord of its bend."""
        ball, thin = self.ball_mm / 2, self.rod_mm / 2
        lengths = ball + np.array([0.0, ball, length_mm])
        return Capsules.along(self.line().at(lengths), [ball, thin])


@dataclass(frozen=True, slots=True)
class Elevator(Shape):
    """Describe a Freer elevator, mm: a thin blade with a round end, slightly bent."""

    width_mm: float = 4.5
    thick_mm: float = 1.0
    blade_mm: float = 24.0
    radius_mm: float = 60.0
    turn_deg: float = 18.0
    shaft_mm: float = 3.0
    length_mm: float = 130.0

    def line(self) -> BentLine:
        """Return its middle."""
        return BentLine(0.0, self.radius_mm, self.turn_deg)

    def _half(self, lengths_mm: Doubles) -> Doubles:
        """Return half the width (x) and thickness at lengths from the tip."""
        wide, thin, shaft = self.width_mm / 2, self.thick_mm / 2, self.shaft_mm / 2
        end = np.clip(lengths_mm / wide, 0.0, 1.0)
        round_mm = wide * np.sqrt(np.maximum(1 - (1 - end) ** 2, 0.0))
        back = np.clip((lengths_mm - 0.3 * self.blade_mm) / (0.7 * self.blade_mm), 0, 1)
        sharp = thin * (0.55 + 0.45 * np.clip(lengths_mm / 4.0, 0.0, 1.0))
        half = np.stack([eased(round_mm, shaft, back), eased(sharp, shaft, back)], 1)
        half[lengths_mm > self.length_mm - 0.1] *= 0.6
        return half

    def _lengths(self) -> Doubles:
        wide = self.width_mm / 2
        front = wide * (1 - np.cos(np.radians([2, 8, 16, 26, 38, 50, 64, 78, 90])))
        behind = np.linspace(wide, self.blade_mm, 9)[1:]
        return np.concatenate([front, behind, [self.length_mm - 0.5, self.length_mm]])

    def parts(self) -> tuple[InstrumentPart, ...]:
        """Return blade and shaft in one."""
        line, lengths = self.line(), self._lengths()
        half = self._half(lengths)
        mesh = skin(rings(line, lengths, half, section(28, 2.3)))
        wide = self.width_mm / 2
        lengths = np.append(
            [0.05 * wide, 0.2 * wide, 0.5 * wide, wide],
            np.append(np.linspace(wide, self.blade_mm, 6)[1:], self.length_mm - 0.5),
        )
        half = self._half(lengths)
        radius = half.min(axis=1) + 0.08
        beside = np.maximum(half[:, 0] - radius, 0.0)
        held = [
            line.place(share * beside, 0.0, lengths)
            for share in (-1.0, -0.5, 0.0, 0.5, 1.0)
        ]
        return (_bladed(mesh, held, radius),)

    def tip(self) -> tuple[Doubles, float]:
        """Return the ball in its end."""
        return self.line().at(self.thick_mm / 2)[0], self.thick_mm / 2

    def end(self, length_mm: float) -> Capsules:
        """Return a chord of the blade, which is hardly bent."""
        half = self.thick_mm / 2
        return Capsules.along(self.line().at([half, half + length_mm]), half)

    def edge(self) -> tuple[Doubles, float]:
        """Return the round end."""
        line = self.line()
        lengths = np.array([1.4, 0.6, 0.15, 0.15, 0.6, 1.4]) + self.thick_mm / 4
        sides = np.array([-1.0, -1.0, -1.0, 1.0, 1.0, 1.0])
        radius = self.thick_mm / 4
        off = sides * (self._half(lengths)[:, 0] - radius)
        return line.place(off, 0.0, lengths), radius
