"""The neck between two rooms of a head: how large it is, and how large it was cut.

It is looked for once, on the head as it was: of all plane sections across a way the one
with the least air. What was air in that plane besides the neck never counts, so that
nothing is gained by a way round; nor does a groove beside it, which does not lead
straight on into the room behind.
"""

import itertools
import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from renderers.scene import Volume

STEP_MM, WIDE_MM = 0.25, 10.0
"""Between the points of a neck's plane, and half its width: a wider opening is cut
off."""

COARSE_MM, NARROW_MM = 0.5, 6.0
"""Likewise of the sections that are compared, and between them."""

DEEP_MM, DEPTH_MM = 8.0, 0.5
"""So far behind a neck the room behind is looked for, and in such steps."""

TILTS_DEG, FINER_DEG = (0.0, 15.0, 30.0, 45.0), (6.0, 3.0, 1.5)
TURNS = 8
"""How far sections are tilted against the way, and into how many directions: walls
stand aslant to the way between two named places. Then the best one is tilted by less.
"""

Doubles = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Neck:
    """The plane of a neck.

    middle: ``(3,)`` LPS mm, on the way. normal: unit, along it. points: ``(m, m, 3)``
    LPS mm. was_neck: ``(m, m)``, the air of the neck as it was. was_air: likewise, of
    whatever room. behind_mm: ``(m, m)``, how far along the normal the room behind
    begins; infinite where it does not.
    """

    middle: Doubles
    normal: Doubles
    points: Doubles
    was_neck: NDArray[np.bool_]
    was_air: NDArray[np.bool_]
    behind_mm: Doubles

    @classmethod
    def between(cls, distance: Volume, start: Doubles, end: Doubles) -> "Neck":
        """Find the neck on a straight way from one room into another.

        distance: signed air distance of the untouched head, mm, negative in air. Where
        the way is blocked, the neck is closed where it is deepest in tissue.
        """
        length = float(np.linalg.norm(end - start))
        along = (end - start) / max(length, 1e-9)
        count = max(math.ceil(length / COARSE_MM), 1) + 1
        middles = np.linspace(start, end, count)
        gaps = distance.sample(middles)
        if gaps.max() >= 0.0:
            middle, normal = middles[int(gaps.argmax())], along
        else:
            sections = itertools.product(middles, _tilted(along, TILTS_DEG))
            middle, normal = _narrowest(distance, sections)
            for tilt_deg in FINER_DEG:
                finer = ((middle, n) for n in _tilted(normal, (0.0, tilt_deg)))
                middle, normal = _narrowest(distance, finer)
        plane = _plane(middle, normal, STEP_MM, WIDE_MM)
        was_air = _sampled(distance, plane) < 0.0
        behind_mm = _behind_mm(distance, plane, normal)
        return cls(middle, normal, plane, _middle_piece(was_air), was_air, behind_mm)

    def opening(self, distance: Volume) -> tuple[float, float]:
        """Return the area of the neck as it is cut now, mm2, and what ball passes, mm.

        Only air counts that hangs together with its middle and leads straight on.
        """
        air = _air(_sampled(distance, self.points), STEP_MM)
        air[self.was_air & ~self.was_neck] = 0.0
        is_cut = (air > 0.0) & ~self.was_neck
        air[is_cut] = self._leading_on(distance, is_cut)
        piece = _piece_at_neck(air > 0.0, self.was_neck)
        area_mm2 = float(air[piece].sum()) * STEP_MM**2
        # carved distances tell of the nearest cut, not of all of them together
        whole = np.pad(piece & (air >= 0.5), 1)
        steps = float(ndimage.distance_transform_edt(whole).max())
        return area_mm2, steps * STEP_MM

    def _leading_on(self, distance: Volume, chosen: NDArray[np.bool_]) -> Doubles:
        """Return what share of chosen squares leads straight into the room behind."""
        depths = np.arange(0.0, DEEP_MM, DEPTH_MM)
        columns = self.points[chosen][:, None] + depths[:, None] * self.normal
        air = _air(distance.sample(columns), STEP_MM)
        behind_mm = self.behind_mm[chosen][:, None]
        air[depths >= behind_mm] = 1.0
        return np.where(np.isfinite(behind_mm[:, 0]), air.min(axis=1), 0.0)


def _behind_mm(distance: Volume, plane: Doubles, normal: Doubles) -> Doubles:
    """Return how far behind a plane's points the room behind its middle begins, mm."""
    depths = np.arange(0.0, DEEP_MM, DEPTH_MM)
    columns = plane[:, :, None] + depths[:, None] * normal
    rooms, _ = ndimage.label(distance.sample(columns) < 0.0)
    ahead = rooms[len(plane) // 2, len(plane) // 2]
    is_room = np.isin(rooms, ahead[ahead > 0][:1])
    begins = depths[is_room.argmax(axis=2)]
    found: Doubles = np.where(is_room.any(axis=2), begins, math.inf)
    return found


def _narrowest(
    distance: Volume, sections: Iterable[tuple[Doubles, Doubles]]
) -> tuple[Doubles, Doubles]:
    """Return the section, middle and normal, with the least air round its middle."""
    return min(sections, key=lambda section: _air_mm2(distance, *section))


def _tilted(along: Doubles, tilts_deg: Iterable[float]) -> list[Doubles]:
    """Return unit normals of sections across a way, tilted into all directions."""
    aside, over = _across(along)
    found = []
    for tilt in np.radians(list(tilts_deg)):
        for turn in np.arange(TURNS if tilt > 0.0 else 1) * (2 * math.pi / TURNS):
            off = math.cos(turn) * aside + math.sin(turn) * over
            found.append(math.cos(tilt) * along + math.sin(tilt) * off)
    return found


def _across(along: Doubles) -> tuple[Doubles, Doubles]:
    aside = np.cross(along, np.eye(3)[int(np.abs(along).argmin())])
    aside /= np.linalg.norm(aside)
    return aside, np.cross(along, aside)


def _plane(middle: Doubles, normal: Doubles, step_mm: float, wide_mm: float) -> Doubles:
    """Return a lattice of points across a normal, ``(m, m, 3)`` LPS mm."""
    aside, over = _across(normal)
    steps = round(wide_mm / step_mm)
    off = step_mm * np.arange(-steps, steps + 1)
    points: Doubles = middle + off[:, None, None] * aside + off[None, :, None] * over
    return points


def _sampled(distance: Volume, points: Doubles) -> Doubles:
    return distance.sample(points.reshape(-1, 3)).reshape(points.shape[:2])


def _air_mm2(distance: Volume, middle: Doubles, normal: Doubles) -> float:
    """Return the area of the air round the middle of a section, mm2."""
    values = _sampled(distance, _plane(middle, normal, COARSE_MM, NARROW_MM))
    air = _air(values, COARSE_MM)
    return float(air[_middle_piece(air > 0.0)].sum()) * COARSE_MM**2


def _air(values: Doubles, step_mm: float) -> Doubles:
    """Return the share of squares that is air, by the distances of their middles."""
    return np.clip(0.5 - values / step_mm, 0.0, 1.0)


def _middle_piece(air: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the air that hangs together with the middle of a section."""
    numbers, _ = ndimage.label(air)
    here = numbers[len(air) // 2, len(air) // 2]
    found: NDArray[np.bool_] = (numbers == here) & air
    return found


def _piece_at_neck(
    air: NDArray[np.bool_], was_neck: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """Return the air that hangs together with the neck, or with its closed middle."""
    if not was_neck.any():
        return _middle_piece(air)
    numbers, _ = ndimage.label(air)
    found: NDArray[np.bool_] = np.isin(numbers, np.unique(numbers[was_neck])) & air
    return found
