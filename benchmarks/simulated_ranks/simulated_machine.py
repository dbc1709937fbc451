"""A machine of simulated ranks: discrete events in order of time."""

import heapq
from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any, Protocol

from benchmarks.simulated_ranks.torus import Torus
from renderers.art.ranks.messages import (
    HEADER_BYTES,
    Message,
    MessageKind,
    ProtocolError,
)
from renderers.art.ranks.node import Node

AT_HOME = (MessageKind.REQUEST, MessageKind.INVALIDATE_REQUEST, MessageKind.ADOPTED)
"""What a cell's home is told: the directory's work."""


class Spender(Protocol):
    """Promise what a machine asks of a node's work: the seconds it has cost so far."""

    @property
    def spent_s(self) -> float:
        """Return the seconds of all work so far."""
        ...


SimulatedRank = tuple[Node[Any], Spender, list[list[Any]]]
"""A rank's node, its work, and its packets by frame."""

_DATA = MessageKind.DATA


@dataclass(frozen=True, slots=True)
class Costs:
    """Set what a machine's actions cost, seconds.

    send_s: start-up of a send. receive_s: taking a message. handle_s: what a node does
    about one. copy_s: handing one byte of a cell from or to the network. poll_s: a look
    for messages. scan_s: passing over one packet that waits, when another is looked
    for (the paper scans its ray stack; 0 where waiting packets are found by cell).
    slice_s: work between two polls. link: bytes/s of a link. hop_s: for each link.
    touch_s: noting that a ray uses a cell; part of the
    cost of work, not added to it.
    """

    send_s: float
    receive_s: float
    handle_s: float
    copy_s: float
    poll_s: float
    scan_s: float
    slice_s: float
    link: float
    hop_s: float
    touch_s: float = 0.0


T3D_CLOCK_S = 1 / 150e6
T3D_READ_CLOCKS = 2 + 14 + 23
T3D_WRITE_CLOCKS = 23
"""A word from another page of the memory, and a line of it written: C. Grassl of Cray
Research, "STREAM for T3D", 31 January 1995 (mail archive of the STREAM benchmark)."""

T3D_TOUCH_S = (3 * T3D_READ_CLOCKS + 4 * T3D_WRITE_CLOCKS) * T3D_CLOCK_S
"""To put a cell first in a list linked both ways: three reads (the cell's place in the
list, its links, the list's head) and four lines written (the cell's, its neighbours'
and the old first's). Counted, not measured; the processor's own steps are left out."""

T3D = Costs(
    send_s=1.5e-6,
    receive_s=1.5e-6,
    handle_s=2e-6,
    copy_s=1 / 300e6,
    poll_s=0.5e-6,
    scan_s=0.0,
    slice_s=1.1e-3,
    link=150e6,
    hop_s=50e-9,
    touch_s=T3D_TOUCH_S,
)
"""The machine of the paper. Its text gives send_s, link, and by its times slice_s, one
ray; the rest are assumptions for a processor of 150 MHz."""


@dataclass(slots=True)
class Ledger:
    """Where a rank's time went, seconds; the parts sum to the whole."""

    render: float = 0.0
    lru: float = 0.0
    scan: float = 0.0
    directory: float = 0.0
    receive: float = 0.0
    send: float = 0.0
    poll: float = 0.0
    idle: float = 0.0

    def parts(self) -> dict[str, float]:
        """Return the parts by name."""
        return {name: getattr(self, name) for name in self.__slots__}


@dataclass(slots=True)
class _Rank:
    node: Node[Any]
    work: Spender
    frames: list[list[Any]]
    inbox: list[tuple[float, int, Message]] = field(default_factory=list)
    idle_since: float | None = None
    due: int = 0
    """Number of the turn that counts; one planned earlier was overtaken."""
    ledger: Ledger = field(default_factory=Ledger)
    ends: list[float] = field(default_factory=list)
    last_arrival: dict[int, float] = field(default_factory=dict)


class Machine:
    """Run nodes on a torus until all their frames are drawn.

    A rank handles messages only between slices. It begins its next frame when it has no
    rays left, without waiting for others. Control of frames is left out, and so are the
    finished pixels.
    """

    def __init__(
        self,
        costs: Costs,
        torus: Torus,
        ranks: Iterable[SimulatedRank],
        *,
        payload_bytes: int,
        lru_share: float = 0.0,
        watch: Callable[["Machine", Message], None] | None = None,
    ) -> None:
        """Take each rank's node, work, and packets by frame.

        payload_bytes: of a cell on its way. lru_share: of the time of work, what noting
        the use of cells costs. watch: called after each message handled.
        """
        self.torus = torus
        self.sent: Counter[MessageKind] = Counter()
        self.data_by_hops: Counter[int] = Counter()
        self.bytes = 0
        """Sent between ranks, headers included."""
        self.seconds = 0.0
        self._costs = costs
        self._payload_bytes = payload_bytes
        self._lru_share = lru_share
        self._watch = watch
        self._ranks = [_Rank(*rank) for rank in ranks]
        self._queue: list[tuple[float, int, int]] = []
        self._number = 0

    @property
    def ledgers(self) -> list[Ledger]:
        """Return the ledgers in order of rank."""
        return [rank.ledger for rank in self._ranks]

    def frame_ends(self) -> list[float]:
        """Return the time at which the last rank finished each frame."""
        return [max(ends) for ends in zip(*(r.ends for r in self._ranks), strict=True)]

    def flying(self) -> list[Message]:
        """List the messages sent and not handled."""
        return [message for rank in self._ranks for _, _, message in rank.inbox]

    def run(self) -> float:
        """Draw all frames; get the seconds it took. What is idle until then is told."""
        for number in range(len(self._ranks)):
            self._schedule(number, 0.0)
        while self._queue:
            now, turn, number = heapq.heappop(self._queue)
            if self._ranks[number].due == turn:
                self._turn(number, now)
        for rank in self._ranks:
            if rank.frames or not rank.node.is_finished or rank.inbox:
                raise ProtocolError(f"rank {rank.node.rank} did not finish")
        self.seconds = max(rank.ends[-1] for rank in self._ranks if rank.ends)
        for rank in self._ranks:
            assert rank.idle_since is not None
            rank.ledger.idle += max(self.seconds - rank.idle_since, 0.0)
        return self.seconds

    def _schedule(self, number: int, when: float) -> None:
        self._number += 1
        self._ranks[number].due = self._number
        heapq.heappush(self._queue, (when, self._number, number))

    def _turn(self, number: int, now: float) -> None:
        rank, costs = self._ranks[number], self._costs
        if rank.idle_since is not None:
            rank.ledger.idle += now - rank.idle_since
            rank.idle_since = None
        now = self._take(rank, now)
        node, work = rank.node, rank.work
        if not node.has_rays and rank.frames:
            if len(rank.ends) < node.frame:
                rank.ends.append(now)
            node.begin(node.frame + 1, rank.frames.pop(0))
        if node.is_active:
            before = work.spent_s
            messages = node.advance(1)
            spent = work.spent_s - before
            rank.ledger.render += spent * (1 - self._lru_share)
            rank.ledger.lru += spent * self._lru_share
            now += spent
            if costs.scan_s:
                scan = costs.scan_s * node.waiting_packets
                rank.ledger.scan += scan
                now += scan
            now = self._send(rank, messages, now)
            self._schedule(number, now)
        elif not node.has_rays and rank.frames:
            self._schedule(number, now)
        else:
            rank.idle_since = now
            if rank.inbox:
                self._schedule(number, max(now, rank.inbox[0][0]))
        if not node.has_rays and len(rank.ends) < node.frame:
            rank.ends.append(now)

    def _take(self, rank: _Rank, now: float) -> float:
        costs, ledger, inbox, work = self._costs, rank.ledger, rank.inbox, rank.work
        handle, control_s = rank.node.handle, costs.receive_s + costs.handle_s
        copy_s = self._payload_bytes * costs.copy_s
        ledger.poll += costs.poll_s
        now += costs.poll_s
        while inbox and inbox[0][0] <= now:
            message = heapq.heappop(inbox)[2]
            kind = message.kind
            if kind in AT_HOME:
                ledger.directory += control_s
                now += control_s
            else:
                cost = control_s
                if kind is _DATA:
                    cost += copy_s
                elif message.payload:
                    cost += len(message.payload) * costs.copy_s
                ledger.receive += cost
                now += cost
            before = work.spent_s
            replies = handle(message)
            spent = work.spent_s - before
            ledger.receive += spent
            now += spent
            if replies:
                now = self._send(rank, replies, now)
            if self._watch is not None:
                self._watch(self, message)
        return now

    def _send(self, rank: _Rank, messages: list[Message], now: float) -> float:
        costs, torus = self._costs, self.torus
        copied = self._payload_bytes
        for message in messages:
            kind, source, target = message.kind, message.source, message.target
            if kind is MessageKind.REGION:
                continue
            more = copied if kind is _DATA else len(message.payload)
            size, cost = HEADER_BYTES + more, costs.send_s + more * costs.copy_s
            self.bytes += size if source != target else 0
            if kind is _DATA:
                self.data_by_hops[torus.hops(source, target)] += 1
            arrival = now
            if source != target:
                now += cost
                rank.ledger.send += cost
                arrival = torus.carry(source, target, size, now)
                self.sent[kind] += 1
            last = rank.last_arrival
            if arrival < last.get(target, 0.0):
                raise ProtocolError(
                    f"a message from {source} to {target} overtook another"
                )
            last[target] = arrival
            self._number += 1
            other = self._ranks[target]
            heapq.heappush(other.inbox, (arrival, self._number, message))
            if other.idle_since is not None and other is not rank:
                head = other.inbox[0][0]
                self._schedule(target, max(head, other.idle_since))
        return now
