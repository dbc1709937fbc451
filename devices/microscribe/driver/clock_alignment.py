"""The arm's clock and the host's: when a tick was, as the host counts time.

A packet is late by what the line and the adapter make it wait, never early. Arrivals
over ticks therefore lie on or above a line; that line is the alignment. It is found
as the edge of the lower convex hull under the middle of the last minute (after Zhang,
Liu and Xia, "Clock synchronization algorithms for network measurements", 2002), which
no burst and no stall can move.
"""

from collections import deque
from itertools import pairwise

TICKS_PER_S = 900.0

# One point, the least delayed, stands for each stretch of the arm's time.
STRETCH_S = 0.5
STRETCHES = 120

# A slope needs a base: a tick of rounding over five seconds is 0.2 permille.
SHORTEST_BASE_S = 5.0

# Two cheap quartzes differ by less; a steeper line is no drift but a mistake.
LARGEST_DRIFT = 3e-4

# From then on the least delay is known.
SETTLED_S = 2.0


class ClockAlignment:
    """The lower envelope of arrival times over ticks."""

    def __init__(self) -> None:
        self.forget()

    def forget(self) -> None:
        """Begin anew: the arm's ticks continue nothing."""
        self._origin: tuple[int, float] | None = None
        self._points: deque[tuple[float, float]] = deque(maxlen=STRETCHES)
        """Seconds on the arm's clock and lateness, of finished stretches."""
        self._least: tuple[float, float] | None = None
        """The same for the stretch that lasts."""
        self._stretch = 0
        self._offset = 0.0
        self.drift = 0.0
        """How much faster the host's clock runs, seconds per second."""
        self._newest_s = float("-inf")

    @property
    def settled(self) -> bool:
        """Return whether arrivals were seen for long enough to tell early from late."""
        return self._stretch * STRETCH_S >= SETTLED_S

    def earliness(self, ticks: int, arrival_s: float) -> float:
        """Return by how many seconds a packet came before it could have."""
        if self._origin is None:
            return 0.0
        elapsed, lateness = self._relative(ticks, arrival_s)
        return self._offset + self.drift * elapsed - lateness

    def observe(self, ticks: int, arrival_s: float) -> float:
        """Take in an arrival; return the host's time of that tick.

        It includes the least delay of the way, is never later than the arrival and
        never runs backwards. ``ticks`` are unwrapped and do not fall.
        """
        if self._origin is None:
            self._origin = (ticks, arrival_s)
        elapsed, lateness = self._relative(ticks, arrival_s)
        stretch = int(elapsed / STRETCH_S)
        if stretch != self._stretch and self._least is not None:
            self._points.append(self._least)
            self._least = None
            self._stretch = stretch
            self._fit()
        if self._least is None or lateness < self._least[1]:
            self._least = (elapsed, lateness)
        self._offset = min(self._offset, lateness - self.drift * elapsed)
        at = arrival_s - lateness + self._offset + self.drift * elapsed
        # A tick is told rounded down.
        at = min(at + 0.5 / TICKS_PER_S, arrival_s)
        self._newest_s = max(self._newest_s, at)
        return self._newest_s

    def _relative(self, ticks: int, arrival_s: float) -> tuple[float, float]:
        assert self._origin is not None
        elapsed = (ticks - self._origin[0]) / TICKS_PER_S
        return elapsed, arrival_s - self._origin[1] - elapsed

    def _fit(self) -> None:
        points = self._points
        self.drift = 0.0
        if points[-1][0] - points[0][0] >= SHORTEST_BASE_S:
            slope = _slope_below(list(points))
            self.drift = max(-LARGEST_DRIFT, min(slope, LARGEST_DRIFT))
        self._offset = min(late - self.drift * at for at, late in points)


def _slope_below(points: list[tuple[float, float]]) -> float:
    """Return the slope of the lower convex hull under the points' mean abscissa."""
    hull: list[tuple[float, float]] = []
    for point in points:
        while len(hull) > 1 and not _turns_left(hull[-2], hull[-1], point):
            hull.pop()
        hull.append(point)
    middle = sum(at for at, _ in points) / len(points)
    left, right = next((a, b) for a, b in pairwise(hull) if b[0] >= middle)
    return (right[1] - left[1]) / (right[0] - left[0])


def _turns_left(
    a: tuple[float, float], b: tuple[float, float], c: tuple[float, float]
) -> bool:
    return (b[0] - a[0]) * (c[1] - a[1]) > (b[1] - a[1]) * (c[0] - a[0])
