"""A picture drawn at once, block by block: who draws which, and what is left of it.

A packet of rays for each strip would hold all that its rays have, written and read
again between one step of the work and the next: for a picture of 512 x 512 that took 3
to 5 ms of 11 to 40. Threads that were handed strips one by one waited for each other,
and for the interpreter: each enters compiled code once and takes turns there.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderers.art.kernels.march_types import (
    BLOCK_COLUMNS,
    F32,
    TILE_PX,
    BlockMemory,
    CellView,
    LensRays,
    PictureArrays,
    RayArrays,
    RaySetUp,
    ShadeSettings,
)
from renderers.art.ranks.rays import RayPacket, tile_order
from renderers.art.regions import Gather, Region

RAYS_A_BLOCK = BLOCK_COLUMNS * TILE_PX
_STRIDE = RAYS_A_BLOCK + 1

MOST_WAITING = 16
"""Blocks that wait for cells until a thread ends its turns, to have them fetched."""


TURNS = 3
"""Numbers by which a picture's blocks are shared out."""


class Blocks:
    """Share out the blocks of a picture. Even threads begin at its top, odd ones below.

    So each stays where it is in the volume, and nobody waits before the end.

    corners: int32 ``(n, 4)`` left, top, right and bottom pixel of each. most: that one
    thread takes before it looks up.
    """

    def __init__(self, corners: NDArray[np.int32]) -> None:
        self.corners = corners
        self.turns: NDArray[np.int64] = np.zeros(TURNS, np.int64)
        self.limit = 0
        self.most = len(corners)

    @classmethod
    def of(
        cls,
        shape: tuple[int, int],
        left: NDArray[np.bool_] | None = None,
        wanted: NDArray[np.bool_] | None = None,
    ) -> "Blocks":
        """Cut what is left of a picture ``(h, w)``.

        left, wanted: ``(h, w)``; only blocks that have any of either. None for all.
        """
        height, width = shape
        tops, lefts = np.arange(0, height, TILE_PX), np.arange(0, width, BLOCK_COLUMNS)
        corners = np.empty((len(tops), len(lefts), 4), np.int32)
        corners[..., 0], corners[..., 1] = lefts, tops[:, None]
        corners[..., 2] = np.minimum(lefts + BLOCK_COLUMNS, width)
        corners[..., 3] = np.minimum(tops + TILE_PX, height)[:, None]
        chosen = np.ones(corners.shape[:2], np.bool_)
        for mask in (left, wanted):
            if mask is not None:
                rows = np.logical_or.reduceat(mask, lefts, axis=1)
                chosen &= np.logical_or.reduceat(rows, tops, axis=0)
        return cls(corners[chosen])

    @property
    def left(self) -> int:
        """Count the blocks that nobody has taken; not while threads are at work."""
        return len(self.corners) - min(int(self.turns[0]), self.limit)

    def allow(self, more: int) -> None:
        """Let threads take so many more; not while they are at work."""
        taken = len(self.corners) - self.left
        self.turns[0] = taken
        self.limit = min(taken + more, len(self.corners))

    def join(self, turns: NDArray[np.int64], most: int) -> None:
        """Take turns with others who have the same blocks, and none is held up."""
        self.turns, self.limit, self.most = turns, len(self.corners), most

    def region(self, number: int) -> Region:
        """Return a block as a region."""
        return Region(*self.corners[number].tolist())


@dataclass(frozen=True, slots=True)
class Strip:
    """What one thread left of the blocks that it took.

    packets: the rays of blocks that wait for cells. counters: of the kernels. fresh:
    pixels that are done now and were not before. early: rays in the picture now that
    ended before their way did.
    """

    packets: list[RayPacket]
    counters: NDArray[np.int64]
    fresh: int = 0
    early: int = 0


DrawBlocks = Callable[..., tuple[int, int, int]]
"""See `renderers.art.kernels.draw_blocks`."""


def draw_strip(
    kernel: DrawBlocks,
    blocks: Blocks,
    who: int,
    lens: LensRays,
    setup: RaySetUp,
    gather: Gather,
    look: tuple[CellView, int, ShadeSettings | F32],
    counters: NDArray[np.int64],
    *,
    takes_along: bool,
) -> Strip:
    """Draw blocks of a picture until none is left, as thread `who`.

    look: cells at hand, shift from voxels to them, what the march needs. takes_along:
    rays keep their last samples. What waits is not in the picture; its memory is a
    strip's.
    """
    rows = MOST_WAITING * _STRIDE
    state = np.empty((3, rows, 4), np.float32)
    rays = RayArrays(
        np.empty(0, np.int32),
        np.empty((rows, 8), np.float32),
        np.empty(rows, np.int32),
        state[0].view(np.int32),
        state[1],
        state[2],
        np.empty(rows, np.float32),
        np.empty((rows if takes_along else 0, 4), np.float32),
    )
    memory = BlockMemory(np.empty(MOST_WAITING, np.int32), rays)
    kept, fresh, early = kernel(
        blocks.corners,
        blocks.turns,
        np.array([blocks.limit, blocks.most]),
        who % 2 > 0,
        lens,
        setup,
        memory,
        PictureArrays(gather.value, gather.depth, gather.done),
        *look,
        counters,
    )
    packets = []
    for k, number in enumerate(memory.waiting[:kept].tolist()):
        block = blocks.region(number)
        lone = slice(k * _STRIDE, k * _STRIDE + block.pixels)
        spared = slice(lone.start, lone.stop + 1)
        packets.append(
            RayPacket(
                block,
                tile_order(block.right - block.left, block.bottom - block.top),
                rays.geometry[spared],
                rays.samples[lone],
                rays.cursor[spared],
                rays.value[spared],
                rays.carry[spared],
                rays.depth[lone],
                front=rays.front[spared],
            )
        )
    return Strip(packets, counters, fresh, early)
