"""A picture that ranks of one machine gather, and share out, in memory of all."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderers.art.blocks import TURNS, Blocks
from renderers.art.crew import Crew
from renderers.art.march import Drawer, FrameRays
from renderers.art.ranks.rays import RayPacket
from renderers.art.ranks.work import MarchWork
from renderers.art.regions import Gather

MOST_BLOCKS = 4
"""That a rank draws between two looks for messages."""

Turns = Callable[[], list[RayPacket] | None]
"""Draws blocks that nobody has taken, and returns rays that wait for cells; None where
none is left."""


class PictureRoom:
    """Where ranks of one machine gather a picture, each its part; kept for the next.

    Rank 0 begins it before it tells the others to draw, and has the picture back before
    it begins another: so nobody waits for anybody, unless the size is another one.
    """

    def __init__(self, crew: Crew) -> None:
        """Take the ranks."""
        self._crew = crew
        self._parts: tuple[NDArray[Any], ...] = ()
        self._turns: NDArray[np.int64] = np.zeros(TURNS, np.int64)

    def fits(self, gather: Gather) -> bool:
        """Return whether there is room for a picture of that size."""
        return bool(self._parts) and self._parts[2].shape == gather.done.shape

    def make(self, gather: Gather) -> None:
        """Make room for a picture of that size, and begin it; all together."""
        height, width = gather.done.shape
        pixels = height * width
        head = 8 * TURNS
        room = self._crew.empty(head + 21 * pixels, np.uint8)
        self._turns = room[:head].view(np.int64)
        value, depth, done = np.split(room[head:], (16 * pixels, 20 * pixels))
        self._parts = (
            value.view(np.float32).reshape(height, width, 4),
            depth.view(np.float32).reshape(height, width),
            done.view(np.bool_).reshape(height, width),
        )
        self._crew.once(lambda: self.begin(gather))

    def begin(self, gather: Gather) -> None:
        """Begin with what is there already; rank 0."""
        self._turns[:] = 0
        for part, before in zip(
            self._parts, (gather.value, gather.depth, gather.done), strict=True
        ):
            part[:] = before

    def enter(self, gather: Gather) -> None:
        """Let a picture be the one that all draw."""
        gather.value, gather.depth, gather.done = self._parts

    def leave(self, gather: Gather) -> None:
        """Take the picture out of the room; rank 0."""
        if self._parts and gather.value is self._parts[0]:
            gather.value, gather.depth, gather.done = (p.copy() for p in self._parts)
            gather.count()

    def turns(
        self,
        rank: int,
        drawer: Drawer,
        work: MarchWork,
        rays: FrameRays,
        finished: NDArray[np.bool_] | None = None,
    ) -> Turns:
        """Return what draws the next of a picture's blocks, as one rank of several.

        finished: ``(h, w)`` the rays that nobody need draw; the same on all ranks.
        """
        wanted = rays.limit > 0 if rays.is_limited else None
        left = None if finished is None else ~finished
        blocks = Blocks.of(rays.limit.shape, left, wanted)
        blocks.join(self._turns, MOST_BLOCKS)

        def draw() -> list[RayPacket] | None:
            if blocks.left:
                return work.draw(drawer, blocks, rays, (rank,))
            return None

        return draw
