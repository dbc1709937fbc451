"""What a node has to do: rays to move, and the values of cells to hand on."""

from collections import deque
from collections.abc import Sequence
from functools import partial
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from renderers.art.blocks import Blocks, Strip
from renderers.art.cells.bricks import Bricks
from renderers.art.cells.cells import CellShare
from renderers.art.crew import Crew
from renderers.art.march import COUNTERS, Drawer, FrameRays
from renderers.art.ranks.messages import ProtocolError
from renderers.art.ranks.rays import P, RayPacket
from renderers.art.ranks.scene_look import SceneLook
from renderers.art.regions import Gather, Region, region_payload
from renderers.scene.thread_pool import Run


class Work(Protocol[P]):
    """Promise what a node needs, whatever a packet is.

    The ray tracer, the simulation and the exhaustive tests of the protocol each have
    one; the node is the same.
    """

    def run(self, packets: list[P], clock: int) -> Sequence[list[int] | None]:
        """Move packets; tell the cells each stopped at, none when it is finished.

        None stands for a packet that was only interrupted, and goes on next.
        clock: stamped on the slots of cells that are used, unless it is 0.
        """
        ...

    def tally(self) -> dict[str, int]:
        """Return what moving rays has cost so far, by name."""
        ...

    def result(self, packet: P) -> bytes:
        """Write what a finished packet found; nothing where rank 0 has it already."""
        ...

    def payload(self, cell: int) -> bytes:
        """Write a held cell's raw values."""
        ...

    def read(self, cell: int) -> bytes:
        """Write the raw values of a cell that is only in the volume's file."""
        ...

    def fill(self, cell: int, slot: int, payload: bytes) -> None:
        """Take a cell that came; show it when rays run next, at the latest."""
        ...

    def show(self, cells: Sequence[int], slots: Sequence[int]) -> None:
        """Let rays use held cells."""
        ...

    def hide(self, cell: int) -> None:
        """Forget a cell, for rays and as raw values."""
        ...

    def renew(self, cell: int) -> None:
        """Read a cell anew after an edit, if its values are kept here."""
        ...


class MarchWork:
    """March packets of rays through bricks.

    keeps_raw: raw values of cells that came are kept, to be handed on; without, only
    this rank's share is. look: at the volume as it is now. seen: the cells that may
    hold something to be seen, or did before an edit, ``(cells,)``.
    """

    def __init__(
        self,
        look: SceneLook,
        bricks: Bricks,
        share: CellShare,
        *,
        keeps_raw: bool,
        seen: NDArray[np.bool_],
    ) -> None:
        self.look = look
        self.bricks = bricks
        self.share = share
        self.seen = seen
        self.counters = np.zeros(len(COUNTERS), np.int64)
        self.ended_early = 0
        self._march = look.march
        self._keeps_raw = keeps_raw
        self._came: dict[int, tuple[int, NDArray[np.generic]]] = {}
        self._map: Run = map
        self._places: NDArray[np.int64] | None = None
        self._gather: Gather | None = None

    def follow(
        self,
        values: NDArray[np.generic],
        box: tuple[NDArray[np.int64], NDArray[np.int64]],
        changed: NDArray[np.int64],
        fresh: NDArray[np.int64],
    ) -> None:
        """Go on with an edited volume; `renew` is called for each changed cell.

        box: of the edited voxels, (k, j, i). fresh: those of the changed cells that
        were empty before.
        """
        self._march = self.look.march
        self.seen[fresh] = True
        self.bricks.follow(values, *box)
        self.share.follow(values, changed)

    def use(self, crew: Crew) -> None:
        """Run packets with a crew's threads; bricks of one that is shared have places.

        The same on all ranks, whoever makes them.
        """
        self._map = crew.run
        if crew.is_shared:
            self._places = np.cumsum(self.seen) - 1

    def deliver(self, gather: Gather | None) -> None:
        """Put what finished packets found where it belongs, instead of into a message.

        None goes back to messages.
        """
        self._gather = gather

    @property
    def occupied(self) -> int:
        """Count the cells that may hold something to be seen."""
        return int(np.count_nonzero(self.seen))

    def tally(self) -> dict[str, int]:
        """Return the kernels' counters."""
        moved = {name: int(n) for name, n in zip(COUNTERS, self.counters, strict=True)}
        return moved | {"ended_early": self.ended_early}

    def start(self, regions: list[Region], rays: FrameRays) -> list[RayPacket]:
        """Put the rays of regions at their first samples."""
        return list(self._map(partial(self._march.start, rays=rays), regions))

    def draw(
        self, drawer: Drawer, blocks: Blocks, rays: FrameRays, threads: Sequence[int]
    ) -> list[RayPacket]:
        """Draw blocks at once, where `deliver` says; get what has to go on.

        Only where nobody needs to know which cells are used. threads: their numbers.
        """
        view, shift = self.bricks.view, self.bricks.grid.shift
        gather = self._gather
        assert gather is not None

        def draw(who: int) -> Strip:
            return drawer(blocks, who, rays, gather, view, shift)

        packets = []
        for strip in self._map(draw, threads):
            self.counters += strip.counters
            self.ended_early += strip.early
            packets += strip.packets
            gather.missing -= strip.fresh
        return packets

    def run(self, packets: list[RayPacket], clock: int) -> list[list[int]]:
        """March each packet until its rays end or miss a cell."""
        self._build()
        view, shift = self.bricks.view, self.bricks.grid.shift

        def march(packet: RayPacket) -> NDArray[np.int64]:
            return self._march.run(packet, view, shift, clock)

        for counters in self._map(march, packets):
            self.counters += counters
        return [packet.missing_cells() for packet in packets]

    def result(self, packet: RayPacket) -> bytes:
        """Write a region with its values and depths; nothing where it is delivered."""
        self.ended_early += self._march.ended_early(packet)
        if self._gather is not None:
            self._gather.add(
                packet.region, packet.value[:-1], packet.depth, packet.carry[:-1]
            )
            return b""
        return region_payload(packet.region, packet.result, packet.depth)

    def payload(self, cell: int) -> bytes:
        """Write a block with its ghosts."""
        return self.share.block(cell).tobytes()

    def read(self, cell: int) -> bytes:
        """Cut a block with its ghosts from the volume."""
        return self.share.read(cell).tobytes()

    def fill(self, cell: int, slot: int, payload: bytes) -> None:
        """Keep a block that came until rays run; ProtocolError at a wrong size.

        Then all that came meanwhile are made bricks together.
        """
        try:
            block = self.share.decode(payload)
        except ValueError as error:
            raise ProtocolError(f"cell {cell} came damaged: {error}") from error
        if self._keeps_raw:
            self.share.put(cell, block)
        self._came[cell] = slot, block

    def show(self, cells: Sequence[int], slots: Sequence[int]) -> None:
        """Make bricks of blocks of this rank's own."""
        if self.share.is_whole:
            chosen = np.array(cells, np.int64)
            self.share.require(chosen)
            where = np.array(slots, np.int64)
            if self._places is not None:
                where = self._places[chosen]
            self.bricks.show_all(chosen, where, self.share.values)
            return
        for cell, slot in zip(cells, slots, strict=True):
            self.bricks.show(cell, slot, self.share.block(cell))

    def hide(self, cell: int) -> None:
        """Take a brick away, and the block unless it is this rank's to keep."""
        self._hide(cell)
        if self._keeps_raw:
            self.share.drop(cell)

    def renew(self, cell: int) -> None:
        """Cut a block anew from the share's source."""
        self._hide(cell)
        self.share.renew(cell)

    def _hide(self, cell: int) -> None:
        self._came.pop(cell, None)
        self.bricks.hide(cell)

    def _build(self) -> None:
        """Make bricks of what has come."""
        if self._came:
            came, self._came = self._came, {}

            def build(cell: int) -> None:
                self.bricks.show(cell, *came[cell])

            deque(self._map(build, list(came)), 0)
