"""Every interleaving of a small system of ranks, run through the nodes that ship.

A state is what all ranks know and what is under way between them. From each state every
possible next step is taken: a rank moves its next packet, or the head of some channel
is delivered. Breadth first, so that the first failure found is the shortest.
"""

import copy
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from benchmarks.simulated_ranks.audit import audit
from benchmarks.simulated_ranks.replay import ReplayWork, Visits
from renderers.art.cells.cache import FRESH, CellCache
from renderers.art.ranks.directory import Directory, ring_distances
from renderers.art.ranks.messages import Message, MessageKind, ProtocolError
from renderers.art.ranks.node import Node
from renderers.art.ranks.rays import RayStack

Rays = list[list[list[int]]]
"""By rank, by packet: the cells it visits."""


@dataclass
class System:
    """Set up ranks; the switches take rules away.

    owner: by cell; ON_DISK for one that its home can read. second: rays of a second
    frame, before which cell 0 is edited.
    """

    owner: list[int]
    home: list[int]
    slots: list[tuple[int, int]]
    rays: Rays
    second: Rays | None = None
    cache: Callable[..., CellCache] = CellCache
    fifo: bool = True
    answers: bool = True
    stays: bool = True
    tells: bool = True
    pending: int = 2
    nodes: list["Node[Visits]"] = field(default_factory=list)

    def __post_init__(self) -> None:
        ranks = len(self.slots)
        for rank, (slots, quota) in enumerate(self.slots):
            cache = self.cache(slots, quota)
            for cell, owner in enumerate(self.owner):
                if owner == rank:
                    cache.own(cell)
            place = Directory(
                rank, np.array(self.home), np.array(self.owner), ring_distances(ranks)
            )
            node = Node(
                ReplayWork(cache),
                place,
                cache,
                migrates=True,
                most_pending=self.pending,
                validate=True,
            )
            node.begin(1, [Visits(cells) for cells in self.rays[rank]])
            node._story = deque(maxlen=0)
            self.nodes.append(node)


Channels = dict[tuple[int, ...], tuple[Message, ...]]


def copied(node: "Node[Visits]") -> "Node[Visits]":
    """Copy what can change; ten times as fast as `copy.deepcopy`."""
    twin, cache = copy.copy(node), copy.copy(node.cache)
    place = copy.copy(node.directory)
    cache._copies = {
        cell: replace(c, deferred=c.deferred[:]) for cell, c in cache._copies.items()
    }
    cache._free, cache.stamp = cache._free[:], cache.stamp.copy()
    cache._fixed = cache._fixed.copy()
    cache._cell_of_slot = cache._cell_of_slot.copy()
    place.entries = {
        cell: replace(e, replicas=e.replicas[:], asked=e.asked[:])
        for cell, e in place.entries.items()
    }
    twin.cache, twin.directory, twin.work = cache, place, ReplayWork(cache)
    twin._wanted, twin._changed = dict(node._wanted), dict(node._changed)
    stack, old = RayStack[Visits](), node._stack
    again = {p: copy.copy(p) for p in (*old._active, *old._needs)}
    stack._active.extend(again[p] for p in old._active)
    stack._needs = {again[p]: cells for p, cells in old._needs.items()}
    stack._inactive = {c: [again[p] for p in q] for c, q in old._inactive.items()}
    twin._stack = stack
    return twin


def key_of(node: "Node[Visits]") -> tuple[Any, ...]:
    """Get all that a rank's behaviour depends on, without names of slots and times."""
    cache = node.cache
    ages = {s: k for k, s in enumerate(sorted({int(t) for t in cache.stamp}))}
    copies = []
    for cell in sorted(cache.cells()):
        c = cache._copies[cell]
        stamp = int(cache.stamp[c.slot])
        age = -1 if stamp == FRESH else ages[stamp]
        # Equal ages go by slot.
        tie = sum(cache.stamp[: c.slot] == stamp) if stamp != FRESH else 0
        flags = c.owned, c.kept, c.version, tuple(c.deferred)
        copies.append((cell, c.state, age, tie, *flags))
    entries = tuple(
        (cell, entry.owner, tuple(entry.replicas), tuple(entry.asked))
        for cell, entry in sorted(node.directory.entries.items())
    )
    stack = node._stack
    active = tuple((tuple(p.cells), p.done) for p in stack._active)
    waiting = tuple(sorted((tuple(p.cells), p.done) for p in stack._needs))
    queues = tuple(
        (cell, tuple((tuple(p.cells), p.done) for p in packets))
        for cell, packets in sorted(stack._inactive.items())
    )
    return (
        *(node.frame, node.generation, tuple(copies), entries, active, waiting, queues),
        tuple(node._wanted),
    )


State = tuple[tuple["Node[Visits]", ...], Channels]


class Exploration:
    """Take every step from every state, breadth first; shortest ways come first."""

    def __init__(self, system: System, most: int = 60_000) -> None:
        self.system = system
        self.failure = ""
        self.steps = 0
        self.kinds: set[MessageKind] = set()
        self._most = most
        self._edges: list[list[tuple[int, int]]] = []
        self._explore()

    @property
    def states(self) -> int:
        return len(self._edges)

    def longest(self) -> int | None:
        """Get the most messages of any run, None when the graph has a cycle."""
        indegree = [0] * self.states
        for edges in self._edges:
            for after, _ in edges:
                indegree[after] += 1
        ready = [k for k, n in enumerate(indegree) if n == 0]
        most, seen = [0] * self.states, 0
        while ready:
            k = ready.pop()
            seen += 1
            for after, cost in self._edges[k]:
                most[after] = max(most[after], most[k] + cost)
                indegree[after] -= 1
                if indegree[after] == 0:
                    ready.append(after)
        return max(most) if seen == self.states else None

    def _explore(self) -> None:
        nodes = tuple(self.system.nodes)
        keys = {id(node): key_of(node) for node in nodes}
        alive = list(nodes)  # ids must not be used again

        def key(state: State) -> tuple[Any, ...]:
            for node in state[0]:
                if id(node) not in keys:
                    keys[id(node)] = key_of(node)
                    alive.append(node)
            return (*(keys[id(n)] for n in state[0]), tuple(sorted(state[1].items())))

        start: State = (nodes, {})
        known = {key(start): 0}
        queue = deque([(start, 0)])
        self._edges.append([])
        while queue:
            state, depth = queue.popleft()
            here = known[key(state)]
            ends = True
            try:
                for after, sent in self._steps(state):
                    ends = False
                    audit(after[0], [m for q in after[1].values() for m in q])
                    mark = key(after)
                    if mark not in known:
                        known[mark] = len(known)
                        self._edges.append([])
                        queue.append((after, depth + 1))
                    self._edges[here].append((known[mark], sent))
            except (ProtocolError, AssertionError) as error:
                self.failure, self.steps = str(error) or "a rank broke", depth + 1
                return
            if ends and not all(node.is_finished for node in state[0]):
                self.failure, self.steps = "stuck", depth
                return
            assert len(known) < self._most, "the system is too large to explore"

    def _steps(self, state: State) -> Iterator[tuple[State, int]]:
        nodes, channels = state
        frame = min(node.frame for node in nodes)
        for rank, node in enumerate(nodes):
            if node.is_active:
                moved = copied(node)
                sent = [m for m in moved.advance(1) if m.kind is not MessageKind.REGION]
                yield self._after(state, rank, moved, channels, sent)
        for channel, queue in channels.items():
            rank = channel[1]
            if not self.system.stays and nodes[rank].is_finished:
                continue
            moved = copied(nodes[rank])
            left = {k: q for k, q in channels.items() if k != channel}
            if queue[1:]:
                left[channel] = queue[1:]
            self.kinds.add(queue[0].kind)
            yield self._after(state, rank, moved, left, moved.handle(queue[0]))
        done = all(node.is_finished for node in nodes)
        if self.system.second and done and frame == 1:
            after = tuple(copied(node) for node in nodes)
            for node, rays in zip(after, self.system.second, strict=True):
                told = self.system.tells or node.cache.owns(0)
                node.edit(1, [0] if told else [])
                node.begin(2, [Visits(cells) for cells in rays])
            yield (after, channels), 0

    def _after(
        self,
        state: State,
        rank: int,
        moved: "Node[Visits]",
        channels: Channels,
        sent: list[Message],
    ) -> tuple[State, int]:
        channels = dict(channels)
        for message in sent:
            if message.kind is MessageKind.KEEP and not self.system.answers:
                continue
            way: tuple[int, ...] = (message.source, message.target)
            if not self.system.fifo:
                way += (int(message.kind),)
            channels[way] = (*channels.get(way, ()), message)
        nodes = (*state[0][:rank], moved, *state[0][rank + 1 :])
        return (nodes, channels), len(sent)
