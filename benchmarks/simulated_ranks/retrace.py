"""Simulated nodes made to do, step by step, what recorded ranks did.

What they say must be the same messages in the same order: then the simulation counts
what real ranks count, given the same order of delivery.
"""

from collections import Counter, deque
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.simulated_ranks.rank_recording import (
    ADVANCE,
    BEGIN,
    HANDLE,
    SAY,
    fields,
)
from benchmarks.simulated_ranks.strands import StrandPacket, StrandWork
from benchmarks.simulated_ranks.trips import Begun, StrandRayNode, StrandTravel
from renderers.art.cells.cache import CellCache
from renderers.art.ranks.directory import Directory
from renderers.art.ranks.messages import Message, MessageKind, ProtocolError
from renderers.art.ranks.node import Node
from renderers.art.ranks.prepare import MarchNode

Frames = Sequence[Sequence[StrandPacket]]


def simulated_node(
    node: Node[Any], costs: NDArray[np.float64] | None = None
) -> Node[StrandPacket]:
    """Make a simulated node like one that has not drawn yet.

    costs: as `StrandWork` takes them.
    """
    cache = CellCache(node.cache.capacity, node.cache.quota)
    for cell in node.cache.cells():
        cache.own(cell)
    place = node.directory
    return Node(
        StrandWork(cache, costs),
        Directory(place.rank, place.home_of, place.first_owner, place.distances),
        cache,
        migrates=node.migrates,
        stamps=node.stamps,
        most_pending=node.most_pending,
    )


def simulated_ray_node(
    node: MarchNode,
    begun: Begun,
    costs: NDArray[np.float64] | None = None,
) -> StrandRayNode:
    """Make a simulated node to which rays travel, for a rank that owns its cells.

    node: prepared for `Dataflow.RAYS`. begun: the same for all ranks.
    """
    work = StrandWork(CellCache(node.cache.capacity), costs)
    place = node.directory
    travel = StrandTravel(work, place.rank, place.home_of, begun)
    return StrandRayNode(travel, place.rank)


class Retracing:
    """Drive nodes by recorded events.

    sent: messages between ranks by kind. moves: of each rank, the features of all its
    work after each `advance` (`benchmarks.simulated_ranks.strands.FEATURES`).
    """

    def __init__(
        self,
        nodes: Sequence[Node[StrandPacket] | StrandRayNode],
        events: Sequence[NDArray[np.int64]],
        frames: Sequence[Frames],
    ) -> None:
        """Take nodes, events and packets by frame, in order of rank."""
        self.sent: Counter[MessageKind] = Counter()
        self.moves: list[list[NDArray[np.float64]]] = [[] for _ in nodes]
        self._nodes = nodes
        self._events = [deque(map(tuple, rows.tolist())) for rows in events]
        self._frames = [deque(of) for of in frames]
        self._flying: dict[tuple[int, int], deque[Message]] = {}

    def run(self) -> None:
        """Go through all events; ProtocolError at the first difference."""
        left = sum(len(events) for events in self._events)
        while left:
            for rank in range(len(self._nodes)):
                while self._events[rank] and self._step(rank):
                    pass
            after = sum(len(events) for events in self._events)
            if after == left:
                raise ProtocolError(f"{left} recorded events wait for one another")
            left = after

    def _step(self, rank: int) -> bool:
        """Do a rank's next event; False when its message is not there yet."""
        events, node = self._events[rank], self._nodes[rank]
        event, *what = events[0]
        if event == HANDLE:
            arrived = self._flying.get((what[1], rank))
            if not arrived:
                return False
            events.popleft()
            message = arrived.popleft()
            if fields(message) != tuple(what):
                raise ProtocolError(f"rank {rank} was told {what}, not {message}")
            said = node.handle(message)
        elif event == ADVANCE:
            events.popleft()
            said = node.advance(what[0])
            if isinstance(node.work, StrandWork):
                self.moves[rank].append(node.work.features.copy())
        elif event == BEGIN:
            events.popleft()
            node.begin(what[3], [p.fresh() for p in self._frames[rank].popleft()])
            said = []
        else:
            raise ProtocolError(f"rank {rank} said {what}; its node here does not")
        for message in said:
            self._hear(rank, message)
        return True

    def _hear(self, rank: int, message: Message) -> None:
        events = self._events[rank]
        expected = events.popleft() if events else ()
        if expected != (SAY, *fields(message)):
            raise ProtocolError(f"rank {rank} says {message}, recorded is {expected}")
        if message.kind is MessageKind.REGION:
            return
        if message.target != rank:
            self.sent[message.kind] += 1
        self._flying.setdefault((rank, message.target), deque()).append(message)
