"""Who holds which cell.

Every cell has a home, drawn at random as in the 1995 paper so that no region of the
volume burdens one rank. Where cells migrate, the home keeps no copy of its own: it
lists the one owner, whose copy may not vanish, and the replicas, which may. A requester
is listed when its request is handled, hence before the cell has reached it.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from renderers.art.ranks.messages import Message, MessageKind, ProtocolError

_GOLDEN = np.uint64(0x9E3779B97F4A7C15)

EMPTY = -1
"""The owner of a cell in which nothing can be seen, and which nobody asks for."""

ON_DISK = -2
"""The owner of a cell that no rank has to keep: its home can read it from the volume's
file at any time. All copies are then replicas and may go."""

MOST_ASKED = 2
"""Replicas asked to become the owner before the old one is told to keep the cell."""

Distances = Callable[[int], Sequence[int]]
"""Maps a rank to what separates it from each rank; hops, for instance."""


def homes(cells: int, ranks: int) -> NDArray[np.int64]:
    """Return each cell's home rank, ``(cells,)``.

    Cell numbers mixed by SplitMix64 (Steele et al., OOPSLA 2014): the same on every
    rank without a word exchanged. A single multiplication will not do: it gave cells 16
    apart, neighbours in many volumes, the same home in 98 % of cases.
    """
    mixed = (np.arange(cells, dtype=np.uint64) + np.uint64(1)) * _GOLDEN
    mixed = (mixed ^ (mixed >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    mixed = (mixed ^ (mixed >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    mixed ^= mixed >> np.uint64(31)
    return ((mixed >> np.uint64(32)) % np.uint64(ranks)).astype(np.int64)


def deal_owners(seen: NDArray[np.bool_], ranks: int) -> NDArray[np.int64]:
    """Return the rank that owns each cell at the start, ``(cells,)``; EMPTY where none.

    Runs of neighbours, equally many a rank: each reads one part of the volume's file.
    """
    owner = np.full(len(seen), EMPTY, np.int64)
    full = np.flatnonzero(seen)
    owner[full] = np.arange(len(full)) * ranks // max(len(full), 1)
    return owner


def ring_distances(ranks: int) -> Distances:
    """Measure along a ring: without a better measure, spread the load evenly."""

    def distances(rank: int) -> Sequence[int]:
        return [min((r - rank) % ranks, (rank - r) % ranks) for r in range(ranks)]

    return distances


@dataclass(slots=True)
class Entry:
    """What a home knows of a cell.

    asked: the replicas asked to adopt it since the owner wished to drop it; the last is
    about to answer. Empty when no such wish is open.
    """

    owner: int
    replicas: list[int] = field(default_factory=list)
    asked: list[int] = field(default_factory=list)


class Directory:
    """Answer for the cells whose home is this rank."""

    def __init__(
        self,
        rank: int,
        home: NDArray[np.int64],
        owner: NDArray[np.int64],
        distances: Distances,
    ) -> None:
        """Take each cell's home, its first owner (or EMPTY, ON_DISK), what is near."""
        self.rank = rank
        self.entries: dict[int, Entry] = {}
        self._home = home
        self.first_owner = owner
        self.distances = distances
        self.moves = 0

    @property
    def home_of(self) -> NDArray[np.int64]:
        """Return each cell's home, ``(cells,)``."""
        return self._home

    def home(self, cell: int) -> int:
        """Look up the rank to ask for a cell."""
        return int(self._home[cell])

    def expect(self, message: Message) -> None:
        """Refuse a message about a cell whose home is elsewhere."""
        cell = message.cell
        if not 0 <= cell < len(self._home):
            raise ProtocolError(f"rank {message.source} asked for cell {cell}")
        if self.home(cell) != self.rank:
            raise ProtocolError(
                f"rank {message.source} asked rank {self.rank} for cell {cell}, whose "
                f"home is rank {self.home(cell)}"
            )

    def entry(self, cell: int) -> Entry:
        """Return what is known of a cell whose home is here."""
        entry = self.entries.get(cell)
        if entry is None:
            if self.first_owner[cell] == EMPTY:
                raise ProtocolError(f"cell {cell} is empty and has no owner")
            entry = self.entries[cell] = Entry(int(self.first_owner[cell]))
        return entry

    def owner(self, cell: int) -> int:
        """Return the listed owner of a cell whose home is here, or ON_DISK."""
        entry = self.entries.get(cell)
        return int(self.first_owner[cell]) if entry is None else entry.owner

    def listed(self, cell: int) -> set[int]:
        """Return the ranks counted as holders of a cell whose home is here."""
        entry = self.entries.get(cell)
        replicas = [] if entry is None else entry.replicas
        return {self.owner(cell), *replicas} - {ON_DISK}

    def handle(self, message: Message) -> Message:
        """Take REQUEST, INVALIDATE_REQUEST or ADOPTED; return the one answer.

        DATA, without its payload, where nobody has the cell and it is to be read.
        """
        self.expect(message)
        if message.kind is MessageKind.REQUEST:
            return self._request(message)
        if message.kind is MessageKind.INVALIDATE_REQUEST:
            return self._release(message)
        return self._adopted(message)

    def forget_replicas(self, cell: int) -> None:
        """Count only the owner's copy; every other was dropped at a frame's end."""
        if self.home(cell) == self.rank and cell in self.entries:
            self.entries[cell].replicas.clear()

    def admit(self, cells: Iterable[int]) -> None:
        """Let empty cells be asked for: homes read them from the volume's file."""
        for cell in cells:
            if self.first_owner[cell] == EMPTY:
                self.first_owner[cell] = ON_DISK

    def check(self) -> None:
        """Raise AssertionError when an invariant is broken."""
        for cell, entry in self.entries.items():
            assert self.home(cell) == self.rank
            assert entry.owner not in entry.replicas
            assert len(set(entry.replicas)) == len(entry.replicas)
            assert len(entry.asked) <= MOST_ASKED

    def _request(self, message: Message) -> Message:
        entry, who = self.entry(message.cell), message.source
        if who == entry.owner or who in entry.replicas:
            raise ProtocolError(f"rank {who} asked for cell {message.cell} it has")
        holders = [rank for rank in (entry.owner, *entry.replicas) if rank != ON_DISK]
        entry.replicas.append(who)
        if not holders:
            return self._say(MessageKind.DATA, who, message)
        holder = self._closest(who, holders)
        return self._say(MessageKind.FORWARD, holder, message, who)

    def _release(self, message: Message) -> Message:
        entry, who = self.entry(message.cell), message.source
        if who in entry.replicas:
            # Also when it is the one asked to adopt: it will then decline.
            entry.replicas.remove(who)
            return self._say(MessageKind.INVALIDATE, who, message)
        if who != entry.owner:
            raise ProtocolError(f"rank {who} would drop cell {message.cell} unlisted")
        if entry.asked:
            raise ProtocolError(f"rank {who} would drop cell {message.cell} twice")
        return self._find_owner(entry, message)

    def _adopted(self, message: Message) -> Message:
        entry, who = self.entry(message.cell), message.source
        if not entry.asked or entry.asked[-1] != who:
            raise ProtocolError(f"rank {who} was not asked to adopt {message.cell}")
        if not message.aux:
            return self._find_owner(entry, message)
        before, entry.owner = entry.owner, who
        entry.replicas.remove(who)
        entry.asked.clear()
        self.moves += 1
        return self._say(MessageKind.INVALIDATE, before, message)

    def _find_owner(self, entry: Entry, message: Message) -> Message:
        left = [rank for rank in entry.replicas if rank not in entry.asked]
        if not left or len(entry.asked) == MOST_ASKED:
            entry.asked.clear()
            return self._say(MessageKind.KEEP, entry.owner, message)
        heir = self._closest(entry.owner, left)
        entry.asked.append(heir)
        return self._say(MessageKind.ADOPT, heir, message)

    def _closest(self, rank: int, holders: list[int]) -> int:
        if len(holders) == 1:
            return holders[0]
        far = self.distances(rank)
        ranks = len(far)
        # Equally near: the next around the ring, so that no rank serves them all.
        return min(holders, key=lambda r: (far[r], (r - rank) % ranks))

    def _say(
        self, kind: MessageKind, target: int, cause: Message, who: int = 0
    ) -> Message:
        return Message(
            kind,
            self.rank,
            target,
            cause.frame,
            cause.cell,
            generation=cause.generation,
            who=who,
        )
