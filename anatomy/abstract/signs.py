"""Signs painted on walls: a framed letter that tells one target from the others."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from anatomy.table_file import read_table

Doubles = NDArray[np.float64]

HALF_MM = 4.0
"""Half the side of a sign."""

_FRAME_MM = (3.1, 3.7)
_LETTER_MM = 2.2
"""Half the height of a letter."""
_STROKE_MM = 0.45
"""Half the width of a stroke."""
_THROUGH_MM = 1.25
"""Paint reaches so far from a sign's plane: to the voxels on either side of it."""

_LETTERS = read_table(
    __file__, "letters.toml", dict[str, tuple[tuple[tuple[float, float], ...], ...]]
)
"""Of each letter its polylines, in units of half its height."""

LETTERS = "".join(_LETTERS)


@dataclass(frozen=True, slots=True)
class Sign:
    """A sign.

    middle: ``(3,)`` mm, on the surface. normal: unit, into the air. up: unit, in the
    sign's plane.
    """

    letter: str
    middle: Doubles
    normal: Doubles
    up: Doubles

    def covers(self, places: Doubles) -> NDArray[np.bool_]:
        """Return which of ``(n, 3)`` places lie on the sign."""
        away = np.abs(places - self.middle)
        is_flat = np.abs(self.normal) < 0.5
        most = np.where(is_flat, HALF_MM, _THROUGH_MM)
        covered: NDArray[np.bool_] = np.all(away <= most, axis=1)
        return covered

    def paint(self, places: Doubles, mirror: float, blur_mm: float) -> Doubles:
        """Return the share of dark paint, 0 to 1, at ``(n, 3)`` places on it.

        mirror: -1 where the space is seen in a mirror: letters then still read from
        left to right. blur_mm: width of a stroke's soft border.
        """
        away = places - self.middle
        right = np.cross(self.up, self.normal)
        u, v = mirror * (away @ right), away @ self.up
        low, high = _FRAME_MM
        edge = np.maximum(np.abs(u), np.abs(v))
        apart = np.abs(edge - (low + high) / 2) - (high - low) / 2
        for stroke in _LETTERS[self.letter]:
            line = _LETTER_MM * np.array(stroke)
            for a, b in pairwise(line):
                apart = np.minimum(apart, _to_segment(u, v, a, b) - _STROKE_MM)
        share: Doubles = np.clip(0.5 - apart / blur_mm, 0.0, 1.0)
        return share


def _to_segment(u: Doubles, v: Doubles, a: Doubles, b: Doubles) -> Doubles:
    along = b - a
    way = ((u - a[0]) * along[0] + (v - a[1]) * along[1]) / (along @ along)
    way = np.clip(way, 0.0, 1.0)
    away: Doubles = np.hypot(u - a[0] - way * along[0], v - a[1] - way * along[1])
    return away
