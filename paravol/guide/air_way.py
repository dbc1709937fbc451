"""The way through a head's air from anywhere to one place.

A field of lengths spreads from the place through the free voxels, in waves: each step
is a few arrays long, so that a window and a flight go on beside it.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from renderers.scene import Volume
from scenarios.tasks.rules import is_in_sight

LEAST_MM = 0.4
"""A scope dents tissue: where this much air is around it, it passes."""

WIDE_MM, NARROW_COST = 2.0, 3.0
"""A way with less air around than the first costs up to so many times its length: it
keeps to the middle of the air where there is room."""

MARGIN_MM = 15.0
"""So far beyond the box of both ends a way is looked for."""

SNAP_MM = 15.0
"""The nearest air that sees a place may be so far from it: landmarks lie in tissue,
too."""

BESIDE_MM = 25.0
"""Places from which the way is so much longer are known, too: who goes astray is led
back."""

HOLD_MM = 4.0
"""A tip in tissue, dented by the scope, is taken for the nearest air so near."""

NEAR_MM = 4.0
"""A shaft is free to turn so near to what holds it."""

TURNS = 10
"""Places of a turning shaft that are looked at."""

DENT_MM = 0.5
"""Skin and mucosa give way to a shaft so far."""

END_MM = 2.0
"""So near to a place tissue keeps no shaft from it: places lie on walls."""

LEAST_BACK_MM = 2.5
"""Less than this is not told: walls give way."""

_AROUND = np.delete(np.argwhere(np.ones((3, 3, 3))) - 1, 13, axis=0)
"""Steps of z, y, x to the neighbours of a voxel."""

_Doubles = NDArray[np.float64]


class AirWay:
    """Know the way to one place from all air that hangs together with it.

    end_mm: ``(3,)`` the air, LPS, where the way ends: it sees the place.
    """

    def __init__(
        self,
        distance: Volume,
        start_mm: _Doubles,
        place_mm: _Doubles,
        still: Callable[[], object] = lambda: None,
    ) -> None:
        """Spread the field; start_mm: from where the way shall lead, ``(3,)`` LPS.

        distance: signed air distance, mm, negative in air. still: called now and then;
        what it raises ends the work. ValueError where no way leads there.
        """
        matrix = distance.voxel_from_world
        ends = np.stack([start_mm, place_mm]) @ matrix[:3, :3].T + matrix[:3, 3]
        margin = MARGIN_MM / distance.spacing_mm
        top = np.array(distance.shape[::-1])
        low = np.clip(np.floor(ends.min(axis=0) - margin), 0, top - 2).astype(int)
        high = np.clip(np.ceil(ends.max(axis=0) + margin) + 1, low + 2, top).astype(int)
        here = tuple(slice(low[a], high[a]) for a in (2, 1, 0))
        air = np.pad(-distance.values[here], 1, constant_values=-1.0)
        self._shape = air.shape
        self._world = distance.world_from_voxel
        self._voxel = matrix
        self._low = low - 1
        self._strides = np.array([air.shape[1] * air.shape[2], air.shape[2], 1])
        self._around = _AROUND @ self._strides
        self._steps = np.linalg.norm(_AROUND[:, ::-1] * distance.spacing_mm, axis=1)
        narrow = np.clip((WIDE_MM - air) / (WIDE_MM - LEAST_MM), 0.0, 1.0)
        cost = (1.0 + (NARROW_COST - 1.0) * narrow).ravel()
        is_free = (air >= LEAST_MM).ravel()
        begin = self._nearest(is_free, start_mm, HOLD_MM)
        if begin is None:
            raise ValueError("the way begins in tissue")
        rooms, _ = ndimage.label(is_free.reshape(air.shape), np.ones((3, 3, 3)))
        rooms = rooms.ravel()
        still()
        end = self._seeing(rooms == rooms[begin], place_mm, distance)
        if end is None:
            raise ValueError("no air that hangs together with the start sees the place")
        self.end_mm = self._place(np.array([end]))[0]
        costs: NDArray[np.float32] = np.where(is_free, cost, np.inf).astype(np.float32)
        self._cost = self._spread(costs, end, begin, still)

    def chain(self, from_mm: _Doubles) -> _Doubles | None:
        """Return the way's points ``(n, 3)`` LPS, voxel by voxel; None off the way."""
        at = self._nearest(np.isfinite(self._cost), from_mm, HOLD_MM)
        if at is None:
            return None
        cost = self._cost
        chain = [at]
        while cost[at] > 0.0:
            beside = at + self._around
            at = int(beside[np.argmin(cost[beside])])
            chain.append(at)
        return self._place(np.array(chain))

    def _spread(
        self,
        cost: NDArray[np.float32],
        end: int,
        begin: int,
        still: Callable[[], object],
    ) -> NDArray[np.float32]:
        """Return the least cost from each voxel to the end, flat; cost: inf in tissue.

        What costs much more than the way from the beginning is left out, as inf.
        """
        found = np.full(len(cost), np.inf, np.float32)
        found[end] = 0.0
        stamp = np.zeros(len(cost), np.int32)
        front = np.array([end])
        steps = self._steps.astype(np.float32)
        while len(front):
            still()
            reached = (front[:, None] + self._around).ravel()
            new = (
                found[front][:, None] + steps * cost[reached].reshape(-1, 26)
            ).ravel()
            limit = found[begin] + BESIDE_MM
            better = np.flatnonzero((new < found[reached] - 1e-4) & (new <= limit))
            reached, new = reached[better], new[better]
            np.minimum.at(found, reached, new)
            # each of them once, without sorting them
            numbers = np.arange(len(reached), dtype=np.int32)
            stamp[reached] = numbers
            front = reached[stamp[reached] == numbers]
        return found

    def _place(self, flat: NDArray[np.int64]) -> _Doubles:
        k, j, i = np.unravel_index(flat, self._shape)
        index = np.stack([i, j, k], axis=1) + self._low
        found: _Doubles = index @ self._world[:3, :3].T + self._world[:3, 3]
        return found

    def _box(
        self, place_mm: _Doubles, reach_mm: float, is_open: NDArray[np.bool_]
    ) -> tuple[NDArray[np.int64], _Doubles]:
        """Return the open voxels within reach of a place, the nearest first."""
        index = self._voxel[:3, :3] @ place_mm + self._voxel[:3, 3] - self._low
        spacing = np.linalg.norm(self._world[:3, :3], axis=0)
        reach = np.ceil(reach_mm / spacing)
        last = np.array(self._shape[::-1]) - 1
        low = np.clip(np.floor(index - reach), 0, last).astype(int)
        high = np.clip(np.ceil(index + reach), 0, last).astype(int)
        axes = [np.arange(low[a], high[a] + 1) * self._strides[2 - a] for a in range(3)]
        flat = (
            axes[2][:, None, None] + axes[1][None, :, None] + axes[0][None, None, :]
        ).ravel()
        flat = flat[is_open[flat]]
        away = np.linalg.norm(self._place(flat) - place_mm, axis=1)
        order = np.argsort(away)
        order = order[away[order] <= reach_mm]
        return flat[order], away[order]

    def _nearest(
        self, is_open: NDArray[np.bool_], place_mm: _Doubles, reach_mm: float
    ) -> int | None:
        flat, _ = self._box(place_mm, reach_mm, is_open)
        return int(flat[0]) if len(flat) else None

    def _seeing(
        self, is_open: NDArray[np.bool_], place_mm: _Doubles, distance: Volume
    ) -> int | None:
        """Return the open voxel nearest to a place that sees it."""
        flat, _ = self._box(place_mm, SNAP_MM, is_open)
        # neighbours see alike
        for number in (*flat[:40], *flat[40::25]):
            if is_in_sight(distance, self._place(np.array([number]))[0], place_mm):
                return int(number)
        return None


def farthest_seen(
    distance: Volume, eye_mm: _Doubles, chain: _Doubles
) -> tuple[int, _Doubles]:
    """Return the last of a way's points ``(n, 3)`` in a row that an eye sees.

    With its number; the first point is taken for seen.
    """
    near, far = 0, len(chain) - 1
    # by bisection: sight seldom comes back
    while near < far:
        middle = (near + far + 1) // 2
        count = int(np.linalg.norm(chain[middle] - eye_mm) / 0.4) + 2
        share = np.linspace(0.0, 1.0, count)[1:, None]
        # the eye itself may be in dented tissue
        share = share[share[:, 0] * count > 4] if count > 8 else share
        read = distance.sample(eye_mm + share * (chain[middle] - eye_mm))
        if read.max() < 0.0:
            near = middle
        else:
            far = middle - 1
    return near, chain[near]


def back_to_turn_mm(
    distance: Volume, pivot_mm: _Doubles, tip_mm: _Doubles, aim_mm: _Doubles
) -> float:
    """Return how far a shaft must be drawn back before it turns towards a place.

    It is straight from the pivot to its tip, and sweeps what lies between. 0 where it
    turns as it is, and where a straight shaft does not get to the place at all: into a
    niche one looks from where one is.
    """
    now, wanted = tip_mm - pivot_mm, aim_mm - pivot_mm
    depth, reach = (float(np.linalg.norm(way)) for way in (now, wanted))
    if depth < NEAR_MM or reach < NEAR_MM:
        return 0.0
    share = np.linspace(0.0, 1.0, TURNS + 1)[1:, None]
    ways = (1.0 - share) * now / depth + share * wanted / reach
    ways /= np.linalg.norm(ways, axis=1)[:, None]
    along = np.arange(NEAR_MM, depth, 0.75)
    swept = pivot_mm + ways[:, None] * along[None, :, None]
    if not _is_straight(distance, pivot_mm, aim_mm):
        return 0.0
    blocked = np.flatnonzero((distance.sample(swept) > DENT_MM).any(axis=0))
    if not len(blocked):
        return 0.0
    # a shaft that bends round an edge near its tip has not to be drawn back
    back_mm = depth - float(along[blocked[0]]) + 1.0
    return back_mm if back_mm > LEAST_BACK_MM else 0.0


def _is_straight(distance: Volume, pivot_mm: _Doubles, place_mm: _Doubles) -> bool:
    """Return whether a thin shaft gets from the pivot straight to a place."""
    way = place_mm - pivot_mm
    reach = float(np.linalg.norm(way))
    along = np.arange(NEAR_MM, reach - END_MM, 0.75)[:, None] * (way / max(reach, 1e-9))
    return not len(along) or bool(distance.sample(pivot_mm + along).max() <= DENT_MM)


def first_of(chain: _Doubles, most_mm: float) -> _Doubles:
    """Return the beginning of a way of points ``(n, 3)``, so long at most."""
    steps = np.linalg.norm(np.diff(chain, axis=0), axis=1)
    count = int(np.searchsorted(np.cumsum(steps), most_mm)) + 1
    return chain[: max(count, 1)]


def length_mm(chain: _Doubles) -> float:
    """Return the length of a way of points ``(n, 3)``, smoothed over a few voxels."""
    coarse = np.concatenate([chain[:-1:6], chain[-1:]])
    return float(np.linalg.norm(np.diff(coarse, axis=0), axis=1).sum())
