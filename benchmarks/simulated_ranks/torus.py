"""A torus of ranks in three dimensions: routes, hops, and links that are busy."""

import math
from functools import lru_cache

_ROUTES_KEPT = 1 << 19
"""Routes looked up once; 4,096 ranks have 16 million, too many to remember."""


def torus_shape(ranks: int) -> tuple[int, int, int]:
    """Return the most cubic torus of so many ranks, longest side first."""
    if ranks < 1:
        raise ValueError(f"a torus needs at least 1 rank, got {ranks}")
    best = (ranks, 1, 1)
    for z in range(1, round(ranks ** (1 / 3)) + 1):
        if ranks % z:
            continue
        rest = ranks // z
        y = max(d for d in range(1, math.isqrt(rest) + 1) if rest % d == 0)
        if y >= z:
            best = (rest // y, y, z)
    return best


class Torus:
    """Carry messages by dimension-order routing, the shorter way around each ring.

    A link carries one message at a time in each direction. A message takes its whole
    route at once when the last of its links is free (wormhole routing without virtual
    channels, a cautious reading of the T3D's network).
    """

    def __init__(self, ranks: int, bytes_per_s: float, hop_s: float) -> None:
        self.ranks = ranks
        self.shape = torus_shape(ranks)
        self.carried = 0
        """Bytes times hops."""
        self._bytes_per_s = bytes_per_s
        self._hop_s = hop_s
        self._free = [0.0] * (6 * ranks)
        self._rows: dict[int, bytes] = {}
        self._route = lru_cache(_ROUTES_KEPT)(self._find_route)

    def place(self, rank: int) -> tuple[int, int, int]:
        """Return a rank's coordinates."""
        nx, ny, _ = self.shape
        return rank % nx, rank // nx % ny, rank // (nx * ny)

    def hops(self, rank: int, other: int) -> int:
        """Count the links between two ranks."""
        return self.distances(rank)[other]

    def distances(self, rank: int) -> bytes:
        """Return the hops from a rank to each rank."""
        if rank not in self._rows:
            here = self.place(rank)
            rings = [
                [min((k - a) % n, (a - k) % n) for k in range(n)]
                for a, n in zip(here, self.shape, strict=True)
            ]
            self._rows[rank] = bytes(
                x + y + z for z in rings[2] for y in rings[1] for x in rings[0]
            )
        return self._rows[rank]

    def carry(self, source: int, target: int, size: int, now_s: float) -> float:
        """Send `size` bytes; get the time at which the last of them has arrived."""
        route = self._route(source, target)
        free = self._free
        begin_s = now_s
        for link in route:
            if free[link] > begin_s:
                begin_s = free[link]
        held_s = size / self._bytes_per_s
        for link in route:
            free[link] = begin_s + held_s
        self.carried += size * len(route)
        return begin_s + len(route) * self._hop_s + held_s

    def _find_route(self, source: int, target: int) -> tuple[int, ...]:
        at, end = list(self.place(source)), self.place(target)
        nx, ny, _ = self.shape
        route = []
        for axis, size in enumerate(self.shape):
            forward = (end[axis] - at[axis]) % size
            step = 1 if 2 * forward <= size else -1
            while at[axis] != end[axis]:
                rank = at[0] + nx * (at[1] + ny * at[2])
                route.append(6 * rank + 2 * axis + (step > 0))
                at[axis] = (at[axis] + step) % size
        return tuple(route)
