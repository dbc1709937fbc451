"""The ray stack: where each ray stopped and what it waits for."""

from collections import deque
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from renderers.art.kernels.march_types import TILE_PX, RayArrays
from renderers.art.regions import Region

P = TypeVar("P")


@lru_cache(maxsize=64)
def tile_order(columns: int, rows: int) -> NDArray[np.int32]:
    """List a region's pixels, numbered row by row, tile by tile."""
    y, x = np.divmod(np.arange(columns * rows), columns)
    order = np.lexsort((x, y, x // TILE_PX, y // TILE_PX))
    return order.astype(np.int32)


def _no_rows() -> NDArray[np.float32]:
    return np.zeros((0, 4), np.float32)


def _no_rays() -> NDArray[np.int32]:
    return np.zeros(0, np.int32)


@dataclass(slots=True, eq=False)
class RayPacket:
    """The rays of one region, row by row, and how far each has come.

    The arrays are those of `RayArrays`. What has been composited is exact and
    resumable, so the picture does not depend on when cells arrive. deflected: int32,
    rays to march that deflectors bend, which are not in `order`.
    """

    region: Region
    order: NDArray[np.int32]
    geometry: NDArray[np.float32]
    count: NDArray[np.int32]
    cursor: NDArray[np.int32]
    value: NDArray[np.float32]
    carry: NDArray[np.float32]
    depth: NDArray[np.float32]
    front: NDArray[np.float32] = field(kw_only=True, default_factory=_no_rows)
    deflected: NDArray[np.int32] = field(kw_only=True, default_factory=_no_rays)

    @classmethod
    def start(
        cls,
        region: Region,
        geometry: NDArray[np.float32],
        count: NDArray[np.int32],
        *,
        takes_along: bool = False,
    ) -> "RayPacket":
        """Put rays at their first sample. takes_along: they keep the last one."""
        n = len(count)
        state = np.zeros((3, n + 1, 4), np.float32)
        return cls(
            region,
            tile_order(region.right - region.left, region.bottom - region.top),
            geometry,
            count,
            state[0].view(np.int32),
            state[1],
            state[2],
            np.full(n, np.inf, np.float32),
            front=np.zeros((n + 1 if takes_along else 0, 4), np.float32),
        )

    @property
    def arrays(self) -> RayArrays:
        """Return what every march takes of rays."""
        return RayArrays(
            self.order,
            self.geometry,
            self.count,
            self.cursor,
            self.value,
            self.carry,
            self.depth,
            self.front,
        )

    @property
    def result(self) -> NDArray[np.float32]:
        """Return colour and alpha, or normal and coverage, of each ray, (n, 4)."""
        return self.value[:-1] + self.carry[:-1]

    def missing_cells(self) -> list[int]:
        """List the cells that rays stopped at, without repetition."""
        cells = self.cursor[:-1, 3]
        waiting = cells[cells > 0]
        return (np.unique(waiting) - 1).tolist() if waiting.size else []


class RayStack(Generic[P]):
    """Keep active packets apart from inactive ones, which wait for cells.

    Inactive packets are found by cell, never by a scan of the stack.
    """

    def __init__(self) -> None:
        self._active: deque[P] = deque()
        self._inactive: dict[int, list[P]] = {}
        self._needs: dict[P, list[int]] = {}

    def __len__(self) -> int:
        return len(self._active) + len(self._needs)

    @property
    def active(self) -> int:
        """Count the packets that can go on."""
        return len(self._active)

    def push(self, packet: P) -> None:
        """Add a packet that can go on."""
        self._active.append(packet)

    def resume(self, packet: P) -> None:
        """Put back a packet that was interrupted; it is the next to go on."""
        self._active.appendleft(packet)

    def pop(self, most: int) -> list[P]:
        """Take up to `most` active packets off the stack, first come first served."""
        return [self._active.popleft() for _ in range(min(most, len(self._active)))]

    def park(self, packet: P, cells: list[int]) -> None:
        """Let a packet wait until any of `cells` comes."""
        if not cells:
            raise ValueError("a packet cannot wait for nothing")
        self._needs[packet] = cells
        for cell in cells:
            self._inactive.setdefault(cell, []).append(packet)

    def wake(self, cell: int) -> int:
        """Make the packets that wait for a cell active; count them."""
        woken = self._inactive.get(cell, [])[:]
        for packet in woken:
            for other in self._needs.pop(packet):
                queue = self._inactive[other]
                queue.remove(packet)
                if not queue:
                    del self._inactive[other]
            self._active.append(packet)
        return len(woken)

    def waited_for(self) -> set[int]:
        """Return the cells that some packet waits for."""
        return set(self._inactive)

    def clear(self) -> None:
        """Drop every packet."""
        self._active.clear()
        self._inactive.clear()
        self._needs.clear()

    def check(self) -> None:
        """Raise AssertionError when an invariant is broken."""
        for packet, cells in self._needs.items():
            assert cells
            for cell in cells:
                assert packet in self._inactive[cell]
        for cell, packets in self._inactive.items():
            assert packets
            assert all(cell in self._needs[packet] for packet in packets)
        assert not any(packet in self._needs for packet in self._active)
