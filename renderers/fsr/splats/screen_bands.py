"""Screen bands: a picture shared out among threads, each draws a band of its tiles.

Sharing is sort-first (Molnar et al., IEEE CG&A 1994): a thread culls, projects, sorts
and composites what its band needs, and nothing is passed between threads. Shared out
stage by stage instead, half of the projected splats are drawn by a core that did not
project them, and fetching them from the other's cache takes as long as projecting.
"""

from bisect import bisect_left
from collections.abc import Sequence
from itertools import accumulate, pairwise

STEP = 0.5
"""Share of the way to the cuts that would have been best that is gone at a time."""

MOST_MOVED = 1 / 32
"""Share of the tiles that a cut moves by at most: times are noisy."""

SNAP = 0.2
"""Share of a row of tiles within which a cut is put between two rows.

Both sides project the splats of a row that is cut.
"""


class ScreenBands:
    """Cut pictures into bands that take equally long, as far as the last ones tell.

    A band is a range of tiles, numbered row by row.
    """

    def __init__(self) -> None:
        self._tiles = 0, 0
        self._cuts: list[float] = []

    def cut(self, down: int, across: int, count: int) -> tuple[range, ...]:
        """Cut so many tiles into `count` bands, fewer where there are not enough."""
        every = down * across
        count = min(count, every)
        if (down, across) != self._tiles or len(self._cuts) != count + 1:
            self._tiles = down, across
            self._cuts = [every * k / count for k in range(count + 1)]
        ends = [0]
        for k, cut in enumerate(self._cuts[1:-1], start=1):
            row = round(cut / across)
            is_near = abs(cut - row * across) <= SNAP * across
            end = row * across if is_near else round(cut)
            # each has one tile at least
            ends.append(min(max(end, ends[-1] + 1), every - count + k))
        return tuple(range(a, b) for a, b in pairwise([*ends, every]))

    def learn(self, bands: Sequence[range], seconds: Sequence[float]) -> None:
        """Move the cuts towards where these bands would have taken equally long.

        Within a band, all tiles are taken to cost the same.
        """
        cuts, count = self._cuts, len(bands)
        if count == 1 or count != len(cuts) - 1 or bands[-1].stop != cuts[-1]:
            return
        passed = list(accumulate(seconds, initial=0.0))
        most = MOST_MOVED * cuts[-1]
        moved = list(cuts)
        for k in range(1, count):
            wanted = passed[-1] * k / count
            band = max(bisect_left(passed, wanted) - 1, 0)
            inside = (wanted - passed[band]) / max(seconds[band], 1e-9)
            best = bands[band].start + inside * len(bands[band])
            moved[k] += min(max(STEP * (best - cuts[k]), -most), most)
        # another thread may cut the next picture meanwhile, and another size
        if self._cuts is cuts:
            self._cuts = moved
