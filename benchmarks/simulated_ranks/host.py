"""A machine whose ranks share its processors, as MPI's ranks on one host do.

The nodes are driven as `Rank` and `MpiTransport` drive them: what a rank has to say
between two looks leaves as one bundle, a rank without work yields, then sleeps. The
processors are shared as Linux shares them among processes of one real-time priority
(SCHED_RR): who yields goes to the end of its processor's line, who works stays for up
to `turn_s`, and a processor without work takes one that waits elsewhere.
"""

import heapq
from collections import Counter, deque
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

from benchmarks.simulated_ranks.simulated_machine import (
    SimulatedNode,
    SimulatedRank,
    Spender,
)
from renderers.art.ranks.ledger import AT_HOME, Ledger
from renderers.art.ranks.messages import Message, MessageKind, ProtocolError

_DATA = MessageKind.DATA
_DONE = MessageKind.DONE
_REGION = MessageKind.REGION


@dataclass(frozen=True, slots=True)
class HostCosts:
    """Set what a rank's actions cost, seconds of a processor.

    message_s: writing, reading and answering one message. own_s: one to oneself.
    bundle_s: handing a bundle to MPI, and taking it. byte_s: of a payload, from the
    sender's hands to the receiver's. gather_s: a byte of finished pixels put in place.
    poll_s: a look for messages that finds none, and the round of the loop about it.
    rest_s: yielding to nobody. switch_s: another rank is taken up. sleep_s: what a rank
    that sleeps is away for. patience_s: time of yielding before. latency_s: from MPI's
    hands to the other rank's. frame_s: of each rank, before a frame's first rays;
    packet_s: of each packet. turn_s: a processor's turn where
    others are in line. busy: work takes so many times as long while another processor
    works, too.
    """

    message_s: float
    own_s: float
    bundle_s: float
    byte_s: float
    gather_s: float
    poll_s: float
    rest_s: float
    switch_s: float
    sleep_s: float
    patience_s: float
    latency_s: float
    frame_s: float = 0.0
    packet_s: float = 0.0
    turn_s: float = 0.1
    busy: float = 1.0


@dataclass(slots=True, eq=False)
class _Process:
    """Follow one rank.

    outgoing: said since its last look, by target. begins_s: of a frame's beginning,
    still to be done. since: when it was given its processor.
    """

    number: int
    node: SimulatedNode
    work: Spender
    frames: deque[list[Any]]
    core: int
    inbox: list[tuple[float, int, list[Message]]] = field(default_factory=list)
    arrived: deque[Message] = field(default_factory=deque)
    outgoing: dict[int, list[Message]] = field(default_factory=dict)
    ledger: Ledger = field(default_factory=Ledger)
    idle_since: float | None = None
    since: float = 0.0
    begins_s: float = 0.0
    worked: bool = False
    said_done: bool = False


class Host:
    """Draw frame after frame with ranks that share processors.

    sent: messages between ranks, by kind; bundles: how many of them were sent as one;
    moves: packets moved.
    """

    def __init__(
        self,
        costs: HostCosts,
        cores: int,
        ranks: Iterable[SimulatedRank],
        *,
        payload_bytes: int,
    ) -> None:
        """Take each rank's node, work, and packets by frame; a cell's bytes."""
        if cores < 1:
            raise ValueError(f"a host needs at least 1 processor, got {cores}")
        self.sent: Counter[MessageKind] = Counter()
        self.bundles = 0
        self.moves = 0
        self._costs = costs
        self._payload_bytes = payload_bytes
        self._ranks = [
            _Process(number, node, work, deque(frames), number % cores)
            for number, (node, work, frames) in enumerate(ranks)
        ]
        self._lines: list[deque[_Process]] = [deque() for _ in range(cores)]
        self._running: list[_Process | None] = [None] * cores
        self._queue: list[tuple[float, int, int, _Process | None]] = []
        self._number = 0
        self._done = 0

    @property
    def ledgers(self) -> list[Ledger]:
        """Return the ledgers in order of rank: time of processors, waiting apart."""
        return [rank.ledger for rank in self._ranks]

    def run(self) -> list[float]:
        """Draw all frames; get the seconds that each took."""
        found = []
        while self._ranks[0].frames:
            found.append(self._frame())
        return found

    def _frame(self) -> float:
        self._queue.clear()
        self._done = 0
        for core in range(len(self._lines)):
            self._lines[core].clear()
            self._running[core] = None
        for rank in self._ranks:
            packets = rank.frames.popleft()
            rank.node.begin(rank.node.frame + 1, packets)
            begins_s = self._costs.frame_s + self._costs.packet_s * len(packets)
            rank.idle_since, rank.worked, rank.said_done = None, True, False
            rank.begins_s = begins_s
            rank.ledger.render += begins_s
            self._plan(0.0, -1, rank)
        while self._queue:
            now, _, core, sleeper = heapq.heappop(self._queue)
            if sleeper is not None:
                self._wake(sleeper, now)
            elif self._act(core, now):
                return self._end(now)
        raise ProtocolError("all ranks wait and nothing is under way")

    def _end(self, now: float) -> float:
        for rank in self._ranks:
            if not rank.node.is_finished or rank.outgoing:
                raise ProtocolError(f"rank {rank.number} did not finish")
        return now

    def _plan(self, when: float, core: int, rank: _Process | None = None) -> None:
        self._number += 1
        heapq.heappush(self._queue, (when, self._number, core, rank))

    def _wake(self, rank: _Process, now: float) -> None:
        """Let a rank that slept run where nobody does, else wait where it was."""
        free = [k for k, other in enumerate(self._running) if other is None]
        if free and rank.core not in free:
            rank.core = free[0]
        self._lines[rank.core].append(rank)
        if self._running[rank.core] is None:
            self._next(rank.core, now)

    def _next(self, core: int, now: float) -> None:
        """Give a processor to the first in line, or to one that waits elsewhere."""
        line = self._lines[core]
        if not line:
            other = max(self._lines, key=len)
            if not other:
                self._running[core] = None
                return
            line = other
        rank = line.popleft()
        rank.core, rank.since = core, now
        self._running[core] = rank
        self._plan(now + self._costs.switch_s, core)

    def _act(self, core: int, now: float) -> bool:
        """Let the rank that runs take one step; tell whether the frame is complete."""
        rank = self._running[core]
        assert rank is not None
        costs = self._costs
        if rank.number == 0 and self._done == len(self._ranks):
            return True
        busy = sum(other is not None for other in self._running) > 1
        slow = costs.busy if busy else 1.0
        now, rank.begins_s = now + rank.begins_s, 0.0
        if not rank.arrived:
            now = self._flush(rank, now)
        line = self._lines[core]
        if rank.arrived or (rank.inbox and rank.inbox[0][0] <= now):
            now += self._take(rank, slow)
            now = self._note(rank, now)
        elif rank.node.is_active:
            rank.worked = False
            rank.ledger.poll += costs.poll_s
            before = rank.work.spent_s
            said = rank.node.advance(1)
            self.moves += 1
            spent = (rank.work.spent_s - before) * slow
            rank.ledger.render += spent
            now = self._note(rank, now + costs.poll_s + spent)
            self._say(rank, said)
            rank.worked = True
            rank.idle_since = None
        elif rank.worked:
            rank.worked = False
            rank.ledger.poll += costs.poll_s
            now = self._note(rank, now + costs.poll_s)
        else:
            return self._rest(rank, core, now)
        if line and now - rank.since >= costs.turn_s:
            line.append(rank)
            self._next(core, now)
        else:
            self._plan(now, core)
        return False

    def _rest(self, rank: _Process, core: int, now: float) -> bool:
        costs = self._costs
        line = self._lines[core]
        if rank.idle_since is None:
            rank.idle_since = now
        cost = costs.poll_s + costs.rest_s
        rank.ledger.idle += cost
        now += cost
        if now - rank.idle_since < costs.patience_s:
            if line:
                line.append(rank)
                self._next(core, now)
            else:
                self._plan(now, core)
        else:
            self._plan(now + costs.sleep_s, -1, rank)
            self._next(core, now)
        return False

    def _flush(self, rank: _Process, now: float) -> float:
        costs = self._costs
        for target, bundle in rank.outgoing.items():
            cost = costs.bundle_s / 2
            rank.ledger.send += cost
            now += cost
            self.bundles += 1
            self._number += 1
            arrival = now + costs.latency_s
            heapq.heappush(self._ranks[target].inbox, (arrival, self._number, bundle))
        rank.outgoing.clear()
        return now

    def _take(self, rank: _Process, slow: float) -> float:
        """Handle what came; get what that cost."""
        costs, ledger, arrived = self._costs, rank.ledger, rank.arrived
        whole = 0.0
        if not arrived:
            arrived += heapq.heappop(rank.inbox)[2]
            whole = costs.bundle_s / 2
            ledger.receive += whole
        rank.worked = True
        rank.idle_since = None
        while arrived:
            message = arrived.popleft()
            kind = message.kind
            size = self._payload_bytes if kind is _DATA else len(message.payload)
            cost = costs.own_s
            if message.source != rank.number:
                cost = costs.message_s + size * costs.byte_s
            if kind is _DONE:
                self._done += 1
            elif kind is _REGION:
                cost += size * costs.gather_s
            else:
                before = rank.work.spent_s
                self._say(rank, rank.node.handle(message))
                cost += (rank.work.spent_s - before) * slow
            if kind in AT_HOME:
                ledger.directory += cost
            else:
                ledger.receive += cost
            whole += cost
        return whole

    def _note(self, rank: _Process, now: float) -> float:
        """Say DONE once, when everything is."""
        if not rank.said_done and rank.node.is_finished:
            rank.said_done = True
            self._say(rank, [Message(_DONE, rank.number, 0, rank.node.frame)])
        return now

    def _say(self, rank: _Process, messages: Iterable[Message]) -> None:
        for message in messages:
            if message.target == rank.number:
                rank.arrived.append(message)
            else:
                rank.outgoing.setdefault(message.target, []).append(message)
                self.sent[message.kind] += 1
