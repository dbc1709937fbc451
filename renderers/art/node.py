"""One rank without communication: messages in, messages out.

A node traces the regions it was dealt. A ray that meets a cell which is not here stops;
its packet is parked, the cell requested from its home, and the packet goes on when the
cell comes. Nothing here knows MPI, clocks or threads of its own.
"""

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderers.art.cache import CellCache, CellState
from renderers.art.cells import CellGrid
from renderers.art.directory import Directory
from renderers.art.march import COUNTERS, March
from renderers.art.messages import Message, MessageKind, ProtocolError
from renderers.art.rays import RayPacket, RayStack
from renderers.art.regions import region_payload

MOST_PENDING = 32
"""Requests in flight from one rank, at most; bounds what it can be sent at once."""

_STORY = 4096

Run = Callable[[Callable[[Any], Any], Iterable[Any]], Iterator[Any]]
"""Something like `map`, which may use threads."""


class Node:
    """Trace this rank's packets and serve the cells whose home it is."""

    def __init__(
        self,
        march: March,
        grid: CellGrid,
        directory: Directory,
        cache: CellCache,
        *,
        validate: bool = False,
    ) -> None:
        """Join the parts.

        validate: check every invariant after each step.
        """
        self.rank = directory.rank
        self.directory = directory
        self.cache = cache
        self.frame = 0
        self.counters = np.zeros(len(COUNTERS), np.int64)
        self.requests = 0
        self._march = march
        self._shift = grid.shift
        self._validate = validate
        self._run: Run = map
        self._stack = RayStack()
        self._wanted: dict[int, None] = {}
        self._clock = 0
        self._story: deque[str] = deque(maxlen=_STORY)

    @property
    def is_finished(self) -> bool:
        """Tell whether no ray is unfinished and no cell is on its way."""
        return not self._stack and not self._wanted and not self.cache.pending

    @property
    def is_active(self) -> bool:
        """Tell whether `advance` could do anything."""
        return self._stack.active > 0

    @property
    def is_waiting(self) -> bool:
        """Tell whether another rank owes this one a cell."""
        return self.cache.pending > 0

    def use(self, run: Run) -> None:
        """Run packets with `map` or with an executor's, which may use threads."""
        self._run = run

    def tally(self) -> dict[str, int]:
        """Get what this node has done so far."""
        tally = {name: int(n) for name, n in zip(COUNTERS, self.counters, strict=True)}
        tally["cells_fetched"] = self.cache.fetches
        tally["cells_evicted"] = self.cache.evictions
        tally["requests"] = self.requests
        return tally

    def begin(self, frame: int, packets: Iterable[RayPacket]) -> None:
        """Start a frame. Cells kept from the frame before stay."""
        if frame <= self.frame:
            raise ProtocolError(f"frame {frame} cannot follow frame {self.frame}")
        self.frame = frame
        for packet in packets:
            self._stack.push(packet)

    def leave(self) -> None:
        """Drop what is left of the frame."""
        self._stack.clear()
        self._wanted.clear()
        self.cache.forget_waiting()

    def handle(self, message: Message) -> list[Message]:
        """Take one message of this frame; return what is to be sent because of it."""
        if message.frame != self.frame:
            raise ProtocolError(
                f"a message of frame {message.frame} came in frame {self.frame}"
            )
        self._story.append(
            f"{message.kind.name} of cell {message.cell} from {message.source} "
            f"to {message.target}"
        )
        if message.kind is MessageKind.REQUEST:
            replies = [self.directory.answer(message)]
        elif message.kind is MessageKind.DATA:
            replies = self._arrive(message)
        else:
            raise ProtocolError(f"a node cannot handle {message.kind.name}")
        if self._validate:
            self.check()
        return replies

    def advance(self, budget: int) -> list[Message]:
        """Run up to `budget` active packets; return requests and finished regions."""
        messages: list[Message] = []
        packets = self._stack.pop(budget)
        self._clock += 1
        for packet, counters in zip(
            packets, self._run(self._march_packet, packets), strict=True
        ):
            self.counters += counters
            missing = packet.missing_cells()
            if missing:
                self._stack.park(packet, missing)
                self._want(missing)
            else:
                messages.append(self._finished(packet))
        messages += self._fetch()
        if self._validate:
            self.check()
        return messages

    def check(self) -> None:
        """Raise AssertionError when an invariant of this rank is broken."""
        self.cache.check()
        self._stack.check()
        waited = self._stack.waited_for()
        # A packet woken by one cell still stands before its others.
        assert set(self._wanted) <= waited or self._stack.active
        for cell in waited:
            pending = self.cache.state(cell) is CellState.PENDING
            assert pending or cell in self._wanted, f"nobody asked for cell {cell}"
        for cell in self._wanted:
            assert self.cache.state(cell) is CellState.INVALID
        assert self.cache.pending <= MOST_PENDING

    def _march_packet(self, packet: RayPacket) -> NDArray[np.int64]:
        clock = self._clock if self.cache.may_evict else 0
        return self._march.run(packet, self.cache.view, self._shift, clock)

    def _want(self, cells: list[int]) -> None:
        # Never a cell that is on its way: it would be fetched again when nobody needs
        # it, and a cell that no ray uses is never evicted.
        for cell in cells:
            if self.cache.state(cell) is CellState.INVALID:
                self._wanted[cell] = None

    def _finished(self, packet: RayPacket) -> Message:
        payload = region_payload(packet.region, packet.value, packet.depth)
        return Message(MessageKind.REGION, self.rank, 0, self.frame, payload=payload)

    def _fetch(self) -> list[Message]:
        """Ask for wanted cells while there is room; take the local ones at once."""
        messages: list[Message] = []
        for cell in list(self._wanted):
            if self.cache.pending >= MOST_PENDING or not self.cache.reserve(cell):
                break
            del self._wanted[cell]
            home = self.directory.home(cell)
            if home == self.rank:
                self.cache.store(cell, self.directory.share.block(cell))
                self._stack.wake(cell)
            else:
                self.requests += 1
                messages.append(
                    Message(MessageKind.REQUEST, self.rank, home, self.frame, cell)
                )
        return messages

    def _arrive(self, message: Message) -> list[Message]:
        try:
            block = self.directory.share.decode(message.payload)
            self.cache.store(message.cell, block)
        except (ProtocolError, ValueError) as error:
            story = "; ".join(
                line for line in self._story if f"cell {message.cell} " in line
            )
            raise ProtocolError(f"{error}. What happened before: {story}") from error
        self._stack.wake(message.cell)
        return self._fetch()
