"""Which cells the rays of a real packet need, in which order: recorded, then replayed.

Rays that need the same cells one after another make a strand. A packet of strands stops
at the same cells as the packet of rays it was recorded from, whatever cells are here.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderers.art.cells.cache import CellCache
from renderers.art.march import COUNTERS
from renderers.art.ranks.messages import ProtocolError
from renderers.art.ranks.rays import RayPacket
from renderers.art.ranks.work import MarchWork

FEATURES = ("starts", "moves", "rays", "visits", "shows", *COUNTERS)
"""What work consists of: rays set up, calls of the kernel, rays it was called for,
stops of rays at a cell's entry, bricks made, and the kernel's own counters."""

_STARTS, _MOVES, _RAYS, _VISITS, _SHOWS = range(5)
_COUNTED = slice(5, None)


@dataclass(slots=True)
class Strand:
    """Follow rays that need the same cells. work: kernel's counters, by cell."""

    cells: tuple[int, ...]
    work: NDArray[np.float64]
    rays: int
    at: int = 0


@dataclass(slots=True, eq=False)
class StrandPacket:
    """Hold the strands of one packet.

    entry: kernel's counters of the way to the first cells. size: bytes of its result.
    has_front: whether rays take their last sample along where they travel.
    """

    strands: list[Strand]
    rays: int
    entry: NDArray[np.float64]
    size: int
    has_begun: bool = False
    has_front: bool = False

    def fresh(self) -> "StrandPacket":
        """Return the packet before its first move."""
        strands = [Strand(s.cells, s.work, s.rays) for s in self.strands]
        return StrandPacket(
            strands, self.rays, self.entry, self.size, has_front=self.has_front
        )


def record_packet(packet: RayPacket, work: MarchWork) -> StrandPacket:
    """Move a packet through one cell after another and note what its rays need.

    work: of a rank that has every cell and room for one; none is shown.
    """
    n = len(packet.count)
    seen: list[list[int]] = [[] for _ in range(n)]
    shares: list[list[NDArray[np.float64]]] = [[] for _ in range(n)]
    start = work.counters.copy()
    missing = work.run([packet], 0)[0]
    before = work.counters.copy()
    entry = (before - start).astype(np.float64)
    while missing:
        cell = missing[0]
        here = np.flatnonzero(packet.cursor[:-1, 3] == cell + 1)
        work.show(cell, 0)
        missing = work.run([packet], 0)[0]
        work.hide(cell)
        each = (work.counters - before) / len(here)
        before = work.counters.copy()
        for ray in here.tolist():
            if seen[ray] and seen[ray][-1] == cell:
                raise ProtocolError(f"a ray does not get out of cell {cell}")
            seen[ray].append(cell)
            shares[ray].append(each)
    strands: dict[tuple[int, ...], list[int]] = {}
    for ray, cells in enumerate(seen):
        if cells:
            strands.setdefault(tuple(cells), []).append(ray)
    made = [
        Strand(cells, np.sum([shares[ray] for ray in rays], axis=0), len(rays))
        for cells, rays in strands.items()
    ]
    size = len(work.result(packet))
    return StrandPacket(made, n, entry, size, has_front=len(packet.front) > 0)


class StrandWork:
    """Move strands through the cells that a node shows; nothing is sampled.

    features: what was done so far, by `FEATURES`. `spent_s` is their cost. A packet is
    interrupted when moving its strands has cost `slice_s` since it was taken up.
    """

    def __init__(
        self,
        cache: CellCache,
        costs: NDArray[np.float64] | None = None,
        *,
        slice_s: float = math.inf,
    ) -> None:
        self.features = np.zeros(len(FEATURES))
        self._costs = np.zeros(len(FEATURES)) if costs is None else costs
        self._slice_s = slice_s
        self._cache = cache
        self._slots: dict[int, int] = {}

    @property
    def spent_s(self) -> float:
        """Return the seconds that all work so far has cost."""
        return float(self.features @ self._costs)

    def tally(self) -> dict[str, int]:
        """Return the number of visits."""
        return {"cells_entered": int(self.features[_VISITS])}

    def run(self, packets: list[StrandPacket], clock: int) -> list[list[int] | None]:
        """Move each strand until it ends, needs a cell, or the slice is over."""
        return [self._run(packet, clock) for packet in packets]

    def result(self, packet: StrandPacket) -> bytes:
        """Write nothing, at the length of a result."""
        return bytes(packet.size)

    def payload(self, cell: int) -> bytes:
        """Stand for a cell's values."""
        return b""

    def read(self, cell: int) -> bytes:
        """Stand for a cell's values, which a file has."""
        return b""

    def fill(self, cell: int, slot: int, payload: bytes) -> None:
        """Show a cell that came."""
        self.show(cell, slot)

    def show(self, cell: int, slot: int) -> None:
        """Let strands use a cell."""
        self._slots[cell] = slot
        self.features[_SHOWS] += 1

    def hide(self, cell: int) -> None:
        """Let strands stop at a cell again."""
        self._slots.pop(cell, None)

    def renew(self, cell: int) -> None:
        """Hide a cell that was changed."""
        self.hide(cell)

    def _run(self, packet: StrandPacket, clock: int) -> list[int] | None:
        slots, stamp, features = self._slots, self._cache.stamp, self.features
        features[_MOVES] += 1
        features[_RAYS] += packet.rays
        if not packet.has_begun:
            packet.has_begun = True
            features[_STARTS] += packet.rays
            features[_COUNTED] += packet.entry
        stops: set[int] = set()
        spent = 0.0
        for strand in packet.strands:
            cells, at = strand.cells, strand.at
            end = at
            while end < len(cells):
                slot = slots.get(cells[end])
                if slot is None:
                    stops.add(cells[end])
                    break
                if spent >= self._slice_s:
                    break
                if clock:
                    stamp[slot] = clock
                if self._slice_s < math.inf:
                    spent += float(strand.work[end] @ self._costs[_COUNTED])
                end += 1
            if end > at:
                features[_VISITS] += strand.rays * (end - at)
                features[_COUNTED] += strand.work[at:end].sum(axis=0)
                strand.at = end
            if spent >= self._slice_s:
                return None
        return sorted(stops)
