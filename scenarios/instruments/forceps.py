"""Tools with jaws: forceps that bite forwards, and the one that bites back."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderers.scene import Mesh
from scenarios.instruments.lofting import BentLine, joined, rod, section, skin
from scenarios.instruments.parts import (
    NO_BITE,
    Capsules,
    InstrumentPart,
    Shape,
    moved,
    shaded,
    turned_about,
)
from surgery import solids

Doubles = NDArray[np.float64]

_WALL_MM = 0.65
"""Thickness of a cup's rim."""

_LEAN = 0.3
"""How far a cup's wall leans inwards, per length: cups are shells."""

_OUTLINE_POWER = 2.4
_OUTLINE = 40
_RIM = 12
"""Facets along a cup's rim and round it."""

_BETWEEN_MM = 1.2
"""Apart at the tip, at most, are the places of a jaw that a bite is made of."""

_PIN_MM = 0.55
"""Radius of a hinge's pin."""

_GAP_MM = 0.02
"""Between closed jaws."""


@dataclass(frozen=True, slots=True)
class Forceps(Shape):
    """Describe forceps that bite forwards, mm.

    shaft_mm, width_mm, height_mm: diameter of the shaft, width and height of the closed
    cups. jaw_mm: from hinge to tip. cup_mm: length of the cup. open_deg: of a jaw from
    the middle. turn_deg: between jaws and shaft, towards +y. through: the upper jaw is
    a blade that passes into the frame of the lower one, which stands still.
    """

    shaft_mm: float = 3.2
    jaw_mm: float = 10.0
    cup_mm: float = 7.0
    width_mm: float = 3.5
    height_mm: float = 2.6
    open_deg: float = 27.0
    turn_deg: float = 0.0
    through: bool = False
    length_mm: float = 130.0

    def line(self) -> BentLine:
        """Return the middle of jaws and shaft."""
        return BentLine(self.jaw_mm + 1.5, 5.0, self.turn_deg)

    def hinge(self) -> tuple[float, float]:
        """Return ``(y, z)`` of the hinge."""
        _, y, z = self.line().at(self.jaw_mm)[0].tolist()
        return y, z

    def parts(self) -> tuple[InstrumentPart, ...]:
        """Return shaft, upper and lower jaw."""
        line, hinge = self.line(), self.hinge()
        radius = self.shaft_mm / 2
        begin = self.jaw_mm - 0.4 * radius
        shaft = rod(line, begin, self.length_mm, (radius, radius))
        lengths = line.stations(begin + radius, self.length_mm - radius)
        kept = [0, *range(1, len(lengths) - 1, 2), -1]
        middle = line.at(lengths[kept])
        half = radius - _PIN_MM / 2
        y, z = hinge
        pin = np.array([[-half, y, z], [half, y, z]])
        caster = line.bend(begin + radius, self.length_mm - radius)
        body = InstrumentPart(
            shaded(joined(shaft, self._pin(radius)), Capsules.along(caster, radius)),
            Capsules.joined(
                [Capsules.along(middle, radius), Capsules.along(pin, _PIN_MM)]
            ),
        )
        low = InstrumentPart(self.jaw(-1), self.jaw_capsules(-1), hinge, -self.open_deg)
        if self.through:
            low = InstrumentPart(low.mesh, low.capsules)
            blade, capsules = self._blade()
            blade = shaded(blade, self._jaw_caster(1))
            return body, InstrumentPart(blade, capsules, hinge, self.open_deg), low
        up = InstrumentPart(self.jaw(1), self.jaw_capsules(1), hinge, self.open_deg)
        return body, up, low

    def _jaw_caster(self, side: int) -> Capsules:
        """Return what casts a jaw's shadow: one capsule, though cups have windows."""
        radius = 0.36 * self.width_mm
        ends = np.array([0.8 * radius, self.jaw_mm])
        y = side * 0.22 * self.height_mm
        return Capsules.along(self.line().place(0.0, y, ends), radius)

    def _pin(self, radius: float) -> Mesh:
        """Return the hinge's pin: a short rod along x."""
        end = radius + _PIN_MM / 4
        bar = rod(BentLine(), -end, end, (_PIN_MM, _PIN_MM), sides=16)
        y, z = self.hinge()
        along = bar.vertices[:, [2, 1, 0]] * np.array([1.0, 1.0, -1.0])
        return Mesh(along + np.array([0.0, y, z]), bar.faces, bar.material)

    def _outline(self, angles: Doubles, inset_mm: Doubles | float) -> Doubles:
        """Return the cup's outline ``(n, 2)`` in x and length, set inwards."""
        half = np.array([self.width_mm, self.cup_mm]) / 2
        both = np.stack([np.cos(angles), np.sin(angles)], axis=1)
        place = np.sign(both) * np.abs(both) ** (2 / _OUTLINE_POWER) * half
        normal = np.sign(both) * np.abs(both) ** (2 - 2 / _OUTLINE_POWER) / half
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        moved_in: Doubles = place - np.reshape(inset_mm, (-1, 1)) * normal
        moved_in[:, 1] += self.cup_mm / 2
        return moved_in

    def _heights(self, lengths_mm: Doubles) -> Doubles:
        """Return how high a jaw is at lengths from the tip: lower at its end, mm."""
        share = np.clip(lengths_mm / (0.6 * self.cup_mm), 0.0, 1.0)
        swell: Doubles = 0.62 + 0.38 * np.sin(share * math.pi / 2)
        return self.height_mm / 2 * swell

    def jaw(self, side: int) -> Mesh:
        """Return a cup with its arm, above the closing plane (1) or below (-1)."""
        line = self.line()
        angles = _around()
        height = self._heights(self._outline(angles, 0.0)[:, 1])
        rim = section(_RIM, 3.0)
        rows = []
        for across, up in rim:
            y = _GAP_MM + height * (up + 1) / 2
            inset = _WALL_MM / 2 * (1 - across) + _LEAN * y
            x, s = self._outline(angles, inset).T
            rows.append(line.place(x, side * y, s))
        cup = skin(np.stack(rows, axis=1), closed=True)
        arm = rod(
            line,
            self.cup_mm - 0.9 * _WALL_MM,
            self.jaw_mm + 0.9,
            (0.24 * self.width_mm, 0.21 * self.height_mm),
            sides=20,
            power=2.6,
            offset_mm=side * (_GAP_MM + 0.22 * self.height_mm),
        )
        return shaded(joined(cup, arm), self._jaw_caster(side))

    def jaw_capsules(self, side: int) -> Capsules:
        """Return what `jaw` is to contact: its rim's middle and its arm."""
        line = self.line()
        angles: Doubles = np.linspace(0.0, 2 * math.pi, 17)
        outer = self._outline(angles, 0.0)
        height = self._heights(outer[:, 1])
        x, s = self._outline(angles, _WALL_MM / 2 + _LEAN * height / 2).T
        rim = line.place(x, side * height / 2, s)
        radius = np.minimum(height[:-1], height[1:]) / 2 + 0.08
        y = side * 0.22 * self.height_mm
        arm_ends = np.array([self.cup_mm - 0.5, self.jaw_mm + 0.4])
        half_x, half_y = 0.24 * self.width_mm, 0.21 * self.height_mm
        off = half_x - half_y
        arms = [line.place(share * off, y, arm_ends) for share in (-1.0, 1.0)]
        return Capsules.joined(
            [
                Capsules.along(rim, radius),
                *(Capsules.along(arm, half_y + 0.05) for arm in arms),
            ]
        )

    def _blade(self) -> tuple[Mesh, Capsules]:
        """Return the upper jaw of a through-cutting punch."""
        line = self.line()
        angles = _around()
        low, high = -0.35 * self.height_mm, 0.42 * self.height_mm
        free = _WALL_MM + 0.08
        rows = []
        for up, rounding in ((0.0, 0.12), (0.08, 0.02), (0.3, 0.0), (0.7, 0.08)):
            rows.append((low + up * (high - low), free + rounding))
        rows += [(high - 0.08, free + 0.3), (high, free + 0.5)]
        laid = []
        for y, inset in rows:
            x, s = self._outline(angles, inset).T
            laid.append(line.place(x, y, s))
        arm = rod(
            line,
            self.cup_mm - 2.2,
            self.jaw_mm + 0.9,
            (0.22 * self.width_mm, 0.21 * self.height_mm),
            sides=20,
            power=2.6,
            offset_mm=0.2 * self.height_mm,
        )
        half = self.width_mm / 2 - free
        radius = (high - low) / 2 + 0.12
        off = max(half - radius + 0.05, 0.0)
        y = (low + high) / 2
        ends = np.array([free + radius - 0.1, self.cup_mm - free - radius + 0.1])
        plate = [
            Capsules.along(line.place(share * off, y, ends), radius)
            for share in (-1.0, 1.0)
        ]
        stem = line.place(
            0.0, 0.2 * self.height_mm, np.array([self.cup_mm - 1.5, self.jaw_mm + 0.3])
        )
        stemmed = Capsules.along(stem, 0.22 * self.width_mm)
        return joined(skin(np.stack(laid)), arm), Capsules.joined([*plate, stemmed])

    def tip(self) -> tuple[Doubles, float]:
        """Return the ball in the end of the closed jaws."""
        radius = 0.8 * self.height_mm / 2
        return self.line().at(radius)[0], radius

    def end(self, length_mm: float) -> Capsules:
        """Return the closed jaws: they are straight, and about as long."""
        radius = 0.8 * self.height_mm / 2
        return Capsules.along(self.line().at([radius, radius + length_mm]), radius)

    def bite(self, jaw: float) -> solids.Rows:
        """Return what the cups hold, in each place on their way together."""
        line, hinge = self.line(), self.hinge()
        radius = self.height_mm / 2
        off = self.width_mm / 2 - radius
        ends = np.array([radius, self.cup_mm - radius])
        most = self.open_deg * (1.0 - jaw)
        travel = math.radians(most) * self.jaw_mm
        count = math.ceil(travel / _BETWEEN_MM)
        angles = np.linspace(0.0, most, count + 1)
        if not self.through:
            angles = np.concatenate([angles, -angles[1:]])
        rows = []
        for angle in angles:
            pose = turned_about(hinge, float(angle))
            for side in (-off, off):
                begin, end = moved(line.place(side, 0.0, ends), pose)
                rows.append(solids.capsule(begin, end, radius))
        return np.concatenate(rows)


def _around() -> Doubles:
    """Return where on a cup's outline its facets begin, radians."""
    return np.linspace(0.0, 2 * math.pi, _OUTLINE, endpoint=False)


@dataclass(frozen=True, slots=True)
class Backbiter(Shape):
    """Describe a backward cutting punch, mm: its cup swings out and bites to the hand.

    The cup opens towards +y. shaft_mm: diameter. jaw_mm: from the hinge to the cup's
    end. cup_mm, width_mm, height_mm: sizes of the cup. open_deg: from the shaft.
    """

    shaft_mm: float = 3.2
    jaw_mm: float = 6.0
    cup_mm: float = 4.2
    width_mm: float = 2.8
    height_mm: float = 1.1
    open_deg: float = 95.0
    length_mm: float = 130.0

    def hinge(self) -> tuple[float, float]:
        """Return ``(y, z)`` of the hinge, near the tip."""
        return 0.55 * self.shaft_mm / 2, 1.5

    def parts(self) -> tuple[InstrumentPart, ...]:
        """Return shaft and jaw."""
        line, radius = BentLine(), self.shaft_mm / 2
        shaft = rod(line, 0.0, self.length_mm, (radius, radius))
        middle = line.at([radius, self.length_mm - radius])
        hinge = self.hinge()
        # the upper jaw of forceps, turned to face the hand
        cup = Forceps(
            jaw_mm=self.jaw_mm,
            cup_mm=self.cup_mm,
            width_mm=self.width_mm,
            height_mm=2 * self.height_mm,
        )
        back = np.diag([-1.0, 1.0, -1.0, 1.0])
        back[1:3, 3] = hinge[0], hinge[1] + self.jaw_mm
        jaw = cup.jaw(1)
        jaw = Mesh(moved(jaw.vertices, back), jaw.faces, jaw.material)
        return (
            InstrumentPart(shaft, Capsules.along(middle, radius)),
            InstrumentPart(
                jaw, cup.jaw_capsules(1).placed(back), hinge, -self.open_deg
            ),
        )

    def tip(self) -> tuple[Doubles, float]:
        """Return the ball in its round end."""
        return np.array([0.0, 0.0, self.shaft_mm / 2]), self.shaft_mm / 2

    def bite(self, jaw: float) -> solids.Rows:
        """Return what lies between the jaw and the shaft, but for the shaft."""
        y, z = self.hinge()
        half = self.height_mm / 2
        off = self.width_mm / 2 - half
        most = self.open_deg * (1.0 - jaw)
        # where the jaw leaves the shaft, from the hinge along the jaw
        clear = self.shaft_mm / 2 + half - y
        far = self.jaw_mm - half
        least = math.degrees(math.asin(clear / far))
        if most <= least:
            return NO_BITE
        count = math.ceil(math.radians(most - least) * far / _BETWEEN_MM)
        rows = []
        for angle in np.linspace(least, most, count + 1):
            sine, cosine = math.sin(math.radians(angle)), math.cos(math.radians(angle))
            near = clear / sine
            for side in (-off, off):
                begin, end = (
                    np.array([side, y + length * sine, z + length * cosine])
                    for length in (near, far)
                )
                rows.append(solids.capsule(begin, end, half))
        return np.concatenate(rows)
