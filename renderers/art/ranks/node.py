"""One rank without communication: messages in, messages out.

A node traces the regions it was dealt. A ray that meets a cell which is not here stops;
its packet is parked, the cell requested from its home, and the packet goes on when the
cell comes. Nothing here knows MPI, clocks or threads of its own, nor what a packet is.

Where cells migrate, the home forwards the request to the nearest holder, and a rank
asks the home before it drops a cell. Where they do not, the home itself has the cell
and a copy is dropped without asking.
"""

from collections import deque
from collections.abc import Iterable
from typing import Generic

from renderers.art.cells.cache import CellCache, CellState
from renderers.art.ranks.directory import Directory
from renderers.art.ranks.messages import CELL_KINDS, Message, MessageKind, ProtocolError
from renderers.art.ranks.rays import P, RayStack
from renderers.art.ranks.work import Work

MOST_PENDING = 32
"""Requests in flight from one rank, at most, and as many wishes to drop a cell; bounds
what it can be sent at once."""

STORY = 4096
"""Messages remembered, to be told when something is wrong."""


class Node(Generic[P]):
    """Trace this rank's packets and serve the cells whose home it is."""

    def __init__(
        self,
        work: Work[P],
        directory: Directory,
        cache: CellCache,
        *,
        migrates: bool,
        stamps: bool = True,
        most_pending: int = MOST_PENDING,
        most_cells: int | None = None,
        story: int = STORY,
        validate: bool = False,
    ) -> None:
        """Join the parts.

        migrates: cells have owners that change. stamps: the use of cells is noted, as
        it must be where any may have to go. most_cells: kept ready, however many become
        visible; None for all. story: messages remembered. validate:
        check every invariant of this rank after each step.
        """
        self.rank = directory.rank
        self.work = work
        self.directory = directory
        self.cache = cache
        self.frame = 0
        self.generation = 0
        self.requests = 0
        self.migrates = migrates
        self.stamps = stamps
        self.most_pending = most_pending
        self.most_cells = most_cells
        self._validate = validate
        self._stack: RayStack[P] = RayStack()
        self._wanted: dict[int, None] = {}
        self._changed: dict[int, int] = {}
        self._clock = 0
        self._story: deque[Message] = deque(maxlen=story)

    @property
    def is_finished(self) -> bool:
        """Return whether no ray is unfinished and no cell is on its way or in question.

        When this holds for every rank, no message about a cell is in flight.
        """
        return not self._stack and not self._wanted and not self.is_waiting

    @property
    def is_active(self) -> bool:
        """Return whether `advance` could do anything."""
        return self._stack.active > 0

    @property
    def has_rays(self) -> bool:
        """Return whether any ray is unfinished."""
        return bool(self._stack)

    @property
    def waiting_packets(self) -> int:
        """Count the packets that wait for a cell."""
        return len(self._stack) - self._stack.active

    @property
    def is_waiting(self) -> bool:
        """Return whether another rank owes this one an answer."""
        return self.cache.pending > 0 or self.cache.asked > 0

    def tally(self) -> dict[str, int]:
        """Return what this node has done so far."""
        return self.work.tally() | {
            "cells_fetched": self.cache.fetches,
            "cells_evicted": self.cache.evictions,
            "requests": self.requests,
            "owners_moved": self.directory.moves,
        }

    def begin(self, frame: int, packets: Iterable[P]) -> None:
        """Start a frame. Cells kept from the frame before stay."""
        if frame <= self.frame:
            raise ProtocolError(f"frame {frame} cannot follow frame {self.frame}")
        self.frame = frame
        self.add(packets)

    def add(self, packets: Iterable[P]) -> None:
        """Take more packets of this frame."""
        for packet in packets:
            self._stack.push(packet)

    def cancel(self) -> None:
        """Drop what is left of the frame; cells on their way still come."""
        self._stack.clear()
        self._wanted.clear()
        self.cache.no_ray_waits()

    def edit(self, generation: int, changed: Iterable[int]) -> None:
        """Go on with a volume in which some cells were changed.

        Between frames only, and on every rank alike. The owners read their cells anew
        from the share's source, which the caller replaced; all other copies go.
        """
        if not self.is_finished:
            raise ProtocolError("a volume can only change between frames")
        if generation <= self.generation:
            raise ProtocolError(
                f"generation {generation} cannot follow {self.generation}"
            )
        self.generation = generation
        for cell in changed:
            self._changed[cell] = generation
            self.directory.forget_replicas(cell)
            if self.cache.owns(cell):
                self.cache.renew(cell, generation)
            elif self.cache.holds(cell):
                self.work.hide(cell)
                self.cache.drop(cell)
            self.work.renew(cell)
        if self._validate:
            self.check()

    def admit(self, fresh: Iterable[int], visible: int) -> None:
        """Make room for cells that become visible by an edit, and may be asked for.

        visible: cells that may be, these included. Between frames only, on every rank
        alike, before `edit`. Where cells migrate nobody owns the new ones: their homes
        read them from the volume.
        """
        room = visible if self.most_cells is None else min(visible, self.most_cells)
        if self.migrates:
            self.directory.admit(fresh)
        elif room > self.cache.capacity:
            self.cache.grow(room - self.cache.capacity)
        self.stamps = self.stamps or visible > self.cache.capacity

    def handle(self, message: Message) -> list[Message]:
        """Take one message about a cell; return what is to be sent because of it."""
        if message.generation != self.generation:
            raise ProtocolError(
                f"a message of generation {message.generation} came in generation "
                f"{self.generation}"
            )
        if message.kind not in CELL_KINDS:
            raise ProtocolError(f"a node cannot handle {message.kind.name}")
        self._story.append(message)
        try:
            replies = self._answer(message)
        except ProtocolError as error:
            raise ProtocolError(
                f"rank {self.rank}: {error}. What happened before: "
                f"{self.story(message.cell)}"
            ) from error
        if self._wanted:
            replies += self._fetch()
        if self._validate:
            self.check()
        return replies

    def advance(self, budget: int) -> list[Message]:
        """Run up to `budget` active packets; return requests and finished regions."""
        messages: list[Message] = []
        packets = self._stack.pop(budget)
        self._clock += 1
        stops = self.work.run(packets, self._clock if self.stamps else 0)
        for packet, missing in zip(packets, stops, strict=True):
            if missing is None:
                self._stack.resume(packet)
            elif missing:
                self._stop(packet, missing)
            elif payload := self.work.result(packet):
                kind = MessageKind.REGION
                messages.append(
                    Message(kind, self.rank, 0, self.frame, payload=payload)
                )
        if self._wanted:
            messages += self._fetch()
        if self._validate:
            self.check()
        return messages

    def story(self, cell: int) -> str:
        """Tell what was said to this rank about a cell lately."""
        return "; ".join(
            f"{m.kind.name} of cell {m.cell} from {m.source}"
            for m in self._story
            if m.cell == cell
        )

    def check(self) -> None:
        """Raise AssertionError when an invariant of this rank is broken."""
        self.cache.check()
        self.directory.check()
        self._stack.check()
        waited = self._stack.waited_for()
        # A packet woken by one cell still stands before its others.
        assert set(self._wanted) <= waited or self._stack.active
        for cell in waited:
            pending = self.cache.state(cell) is CellState.PENDING
            assert pending or cell in self._wanted, f"nobody asked for cell {cell}"
        for cell in self._wanted:
            assert self.cache.state(cell) is CellState.INVALID
        assert self.cache.pending <= self.most_pending
        for cell in self.cache.cells():
            if self.cache.holds(cell):
                newest = self._changed.get(cell, 0)
                assert self.cache.version(cell) == newest, f"cell {cell} is stale"
        if self._wanted and not self.cache.pending and not self.cache.asked:
            # Else nothing would ever happen again. What is left are cells that came
            # and were not used yet, or that are kept; the former's rays can go on.
            assert self._stack.active, "all slots are taken and no ray can go on"

    def _stop(self, packet: P, missing: list[int]) -> None:
        here = [cell for cell in missing if self.cache.holds(cell)]
        if here:
            # Owned from the start, and no ray has met them until now.
            self.work.show(here, [self.cache.slot(cell) for cell in here])
        # Never a cell that is on its way: it would be fetched again when nobody needs
        # it, and a cell that no ray uses is never evicted.
        for cell in missing:
            if self.cache.state(cell) is CellState.INVALID:
                self._wanted[cell] = None
        if here:
            self._stack.push(packet)
        else:
            self._stack.park(packet, missing)

    def _say(
        self,
        kind: MessageKind,
        target: int,
        cell: int,
        payload: bytes = b"",
        *,
        aux: int = 0,
    ) -> Message:
        return Message(
            kind,
            self.rank,
            target,
            self.frame,
            cell,
            payload,
            generation=self.generation,
            aux=aux,
        )

    def _fetch(self) -> list[Message]:
        """Ask for wanted cells while there is room; take the local ones at once."""
        messages: list[Message] = []
        local = [] if self.migrates else self._take_local()
        while self._wanted and self.cache.pending < self.most_pending:
            cell = next(iter(self._wanted))
            if not self.cache.reserve(cell):
                if self.migrates:
                    return messages + self._ask_for_room()
                if not self._make_room():
                    break
                self.cache.reserve(cell)
            del self._wanted[cell]
            home = self.directory.home(cell)
            if home == self.rank and not self.migrates:
                local.append(cell)
                self.cache.store(cell, self._changed.get(cell, 0))
                self._stack.wake(cell)
            else:
                self.requests += home != self.rank
                messages.append(self._say(MessageKind.REQUEST, home, cell))
        if local:
            self.work.show(local, [self.cache.slot(cell) for cell in local])
        return messages

    def _take_local(self) -> list[int]:
        """Take all wanted cells of this rank's own that there is room for."""
        home, rank = self.directory.home, self.rank
        cells = [cell for cell in self._wanted if home(cell) == rank]
        cells = cells[: self.cache.free]
        if cells:
            versions = [self._changed.get(cell, 0) for cell in cells]
            self.cache.fill(cells, versions, fresh=bool(self._stack))
            for cell in cells:
                del self._wanted[cell]
                self._stack.wake(cell)
        return cells

    def _make_room(self) -> bool:
        cell = self.cache.victim()
        if cell is None:
            return False
        self.work.hide(cell)
        self.cache.drop(cell)
        self.cache.evictions += 1
        return True

    def _ask_for_room(self) -> list[Message]:
        """Ask homes for leave to drop the cells used longest ago."""
        messages: list[Message] = []
        enough = min(len(self._wanted), self.most_pending)
        while self.cache.asked < enough:
            cell = self.cache.victim()
            if cell is None:
                break
            self.cache.ask(cell)
            home = self.directory.home(cell)
            messages.append(self._say(MessageKind.INVALIDATE_REQUEST, home, cell))
        return messages

    def _answer(self, message: Message) -> list[Message]:
        kind, cell = message.kind, message.cell
        if kind is MessageKind.DATA:
            return self._arrive(message)
        if kind is MessageKind.REQUEST and not self.migrates:
            self.directory.expect(message)
            return [self._data(cell, message.source)]
        if not self.migrates:
            raise ProtocolError(f"{kind.name} came where cells do not migrate")
        if kind is MessageKind.FORWARD:
            ready = self.cache.serve(cell, message.who)
            return [self._data(cell, message.who)] if ready else []
        if kind is MessageKind.INVALIDATE:
            self.cache.purge(cell)
            self.work.hide(cell)
            return []
        if kind is MessageKind.KEEP:
            self.cache.keep(cell)
            return []
        if kind is MessageKind.ADOPT:
            yes = self.cache.adopt(cell)
            return [self._say(MessageKind.ADOPTED, message.source, cell, aux=int(yes))]
        answer = self.directory.handle(message)
        if answer.kind is MessageKind.DATA:
            # Nobody has it; what is read from the file is of the newest generation.
            version = self._changed.get(cell, 0)
            answer = answer._replace(payload=self.work.read(cell), aux=version)
        return [answer]

    def _data(self, cell: int, target: int) -> Message:
        payload = self.work.payload(cell)
        held = self.cache.holds(cell) and self.migrates
        version = self.cache.version(cell) if held else self._changed.get(cell, 0)
        return self._say(MessageKind.DATA, target, cell, payload, aux=version)

    def _arrive(self, message: Message) -> list[Message]:
        cell = message.cell
        if message.aux != self._changed.get(cell, 0):
            raise ProtocolError(
                f"cell {cell} came as generation {message.aux} left it, not "
                f"{self._changed.get(cell, 0)}"
            )
        deferred = self.cache.store(cell, message.aux, fresh=bool(self._stack))
        self.work.fill(cell, self.cache.slot(cell), message.payload)
        self._stack.wake(cell)
        return [self._data(cell, rank) for rank in deferred]
