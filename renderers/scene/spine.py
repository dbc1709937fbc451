"""A long tool as a chain of round capsules: what takes light away from the tissue.

A shadow needs no triangles. A tube of thousands of them is a few capsules, and what a
capsule hides of a light that is no point has a closed form.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

SLICE_MM = 2.0
"""Length along the tool over which its middle is taken."""

BEND_MM = 0.1
"""How far the middle may be off its capsules."""

_WIDTH_SHARE = 0.9
"""A capsule is as wide as this share of its surface lies from the axis at most: the
widest corner would make a jaw's shadow too wide."""

Doubles = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Spine:
    """Capsules.

    start_mm, end_mm: ``(n, 3)`` float64. radius_mm: ``(n,)``.
    is_free: ``(n, 2)``; whether the start and the end are ends of the tool, cut off
    flat, and not joints, which are round.
    """

    start_mm: Doubles
    end_mm: Doubles
    radius_mm: Doubles
    is_free: NDArray[np.bool_]

    @classmethod
    def of(cls, capsules: Doubles) -> "Spine":
        """Return capsules ``(n, 7)``, start, end and radius, with round ends."""
        is_free = np.zeros((len(capsules), 2), np.bool_)
        return cls(capsules[:, :3], capsules[:, 3:6], capsules[:, 6], is_free)

    @classmethod
    def through(cls, points_mm: Doubles, area: Doubles) -> "Spine":
        """Lay capsules through a surface given as points ``(n, 3)`` and their areas.

        Follows the middle of slices across the direction in which the surface is
        longest: for tools that are longer than wide and do not turn back.
        """
        weight = area / area.sum()
        centre = weight @ points_mm
        away = points_mm - centre
        _, axes = np.linalg.eigh((away * weight[:, None]).T @ away)
        longest = axes[:, -1]
        along = away @ longest
        low, high = along.min(), along.max()
        count = max(1, round((high - low) / SLICE_MM))
        place = ((along - low) / max(high - low, 1e-9) * count).astype(int)
        place = np.minimum(place, count - 1)
        share = np.bincount(place, weight, count)
        held = share > 0
        sums = [np.bincount(place, weight * away[:, k], count)[held] for k in range(3)]
        middles: Doubles = np.stack(sums, axis=1) / share[held, None]
        if len(middles) == 1:
            middles = np.stack([middles[0], middles[0] + 1e-3 * longest])
        corners: Doubles = middles[_corners(middles, BEND_MM)]
        for tip, inner, last in ((0, 1, 0), (-1, -2, count - 1)):
            outwards = corners[tip] - corners[inner]
            outwards = outwards / np.linalg.norm(outwards)
            beyond = ((away[place == last] - corners[tip]) @ outwards).max()
            corners[tip] += beyond * outwards
        start, end = corners[:-1], corners[1:]
        radius = _radii(away, weight, start, end)
        is_free = np.zeros((len(start), 2), np.bool_)
        is_free[0, 0] = is_free[-1, 1] = True
        return cls(start + centre, end + centre, radius, is_free)

    def holds(self, place_mm: Doubles) -> bool:
        """Return whether a place ``(3,)`` is within a capsule."""
        axis, off = self.end_mm - self.start_mm, place_mm - self.start_mm
        square = np.maximum((axis * axis).sum(axis=1), 1e-12)
        share = np.clip((off * axis).sum(axis=1) / square, 0.0, 1.0)
        away = np.linalg.norm(off - share[:, None] * axis, axis=1)
        return bool(np.any(away < self.radius_mm))

    def placed(self, world_from_mesh: Doubles) -> "Spine":
        """Move the capsules by a rigid 4x4 transform."""
        turn, shift = world_from_mesh[:3, :3], world_from_mesh[:3, 3]
        return Spine(
            self.start_mm @ turn.T + shift,
            self.end_mm @ turn.T + shift,
            self.radius_mm,
            self.is_free,
        )


def _corners(line: Doubles, most_mm: float) -> list[int]:
    """Choose points of a line ``(n, 3)`` that it stays near to (Douglas, Peucker)."""
    first, last = line[0], line[-1]
    axis = (last - first) / max(float(np.linalg.norm(last - first)), 1e-12)
    off = line - first
    apart = np.linalg.norm(off - (off @ axis)[:, None] * axis, axis=1)
    worst = int(apart.argmax())
    if apart[worst] <= most_mm:
        return [0, len(line) - 1]
    left = _corners(line[: worst + 1], most_mm)
    right = _corners(line[worst:], most_mm)
    return left[:-1] + [worst + k for k in right]


def _radii(points: Doubles, weight: Doubles, start: Doubles, end: Doubles) -> Doubles:
    """Return each capsule the distance of the surface that is nearest to its axis."""
    axis = end - start
    length = np.linalg.norm(axis, axis=1)
    axis = axis / length[:, None]
    off = points[:, None] - start
    along = np.clip((off * axis).sum(axis=2), 0, length)
    apart = np.linalg.norm(off - along[..., None] * axis, axis=2)
    owner = apart.argmin(axis=1)
    radii = np.empty(len(start))
    for capsule in range(len(start)):
        mine = owner == capsule
        if not mine.any():
            radii[capsule] = np.median(apart.min(axis=1))
            continue
        order = np.argsort(apart[mine, capsule])
        summed = np.cumsum(weight[mine][order])
        at = np.searchsorted(summed, _WIDTH_SHARE * summed[-1])
        radii[capsule] = apart[mine, capsule][order][min(at, len(order) - 1)]
    return radii
