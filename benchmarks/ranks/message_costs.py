"""What messages and waiting cost real ranks that draw nothing.

`python -m mpi4py -m benchmarks.ranks.message_costs FOLDER` is one rank. FOLDER holds
`asking.json`; each rank leaves `asked-<n>.json` there.
"""

import os
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import msgspec
import numpy as np

from benchmarks.ranks.mpi_frames import start_ranks
from benchmarks.simulated_ranks.rank_recording import Recording
from benchmarks.simulated_ranks.replay import ReplayWork, Visits
from renderers.art.cells.cache import CellCache
from renderers.art.ranks.directory import Directory, homes
from renderers.art.ranks.messages import Message
from renderers.art.ranks.node import Node
from renderers.art.ranks.rank import Rank
from renderers.art.ranks.transport import Transport
from renderers.art.regions import Gather, Region, region_payload

CELLS = 512
CELL_BYTES = 11**3 * 2
"""Of a cell of 8 voxels a side, int16, with its ghosts."""

_FEW, _MANY = 100, 4000
"""Times that waiting is tried: within the time in which a rank yields, and beyond."""


class Pattern(msgspec.Struct, frozen=True, kw_only=True):
    """Set how each rank asks: so often, `at_once` of them missed together.

    cell_bytes: of a cell's values.
    """

    visits: int
    at_once: int = 1
    cell_bytes: int = CELL_BYTES


class PatternJob(msgspec.Struct, frozen=True, kw_only=True):
    """Set patterns, tried one after another. waits: measure waiting, too."""

    patterns: tuple[Pattern, ...] = ()
    waits: bool = False


class PatternCost(msgspec.Struct, frozen=True, kw_only=True):
    """Say what one rank's part in a pattern cost.

    spent_s: of messages and of waiting. messages: sent; bundles: handed to MPI;
    bytes: of cells; looks, rests: of a rank that had nothing. latency_s: from requests
    to their cells.
    """

    spent_s: float
    messages: int
    bundles: int
    bytes: int
    looks: int
    rests: int
    latency_s: tuple[float, ...]


class PatternReport(msgspec.Struct, frozen=True, kw_only=True):
    """Say what asking and waiting cost one rank.

    poll_s: a look that finds nothing, with the loop about it. rest_s: giving the
    processor away to nobody. crowd_s: both, as long as they take when all ranks do so
    at once. sleep_s: being away on purpose; patience_s: what a rank yields for before.
    """

    patterns: tuple[PatternCost, ...]
    poll_s: float = 0.0
    rest_s: float = 0.0
    crowd_s: float = 0.0
    sleep_s: float = 0.0
    patience_s: float = 0.0


def run_patterns(
    ranks: int, job: PatternJob, folder: Path, *launcher: str
) -> list[PatternReport]:
    """Ask with so many processes; RuntimeError says what they said if it fails."""
    (folder / "asking.json").write_bytes(msgspec.json.encode(job))
    start_ranks(ranks, "benchmarks.ranks.message_costs", folder, *launcher)
    return [
        msgspec.json.decode(
            (folder / f"asked-{n}.json").read_bytes(), type=PatternReport
        )
        for n in range(ranks)
    ]


def main(words: Sequence[str]) -> int:
    """Be one rank."""
    from renderers.art.ranks.mpi import YIELD_S, MpiTransport

    folder = Path(words[0])
    job = msgspec.json.decode((folder / "asking.json").read_bytes(), type=PatternJob)
    transport = MpiTransport(folder=folder)
    counted = _Counted(transport)
    rank = Rank(counted, time.perf_counter)
    poll_s = rest_s = crowd_s = sleep_s = 0.0
    if job.waits:
        transport.meet()
        crowd_s = _crowd(rank)
        transport.meet()
        poll_s = _quickest(rank.step, _MANY)
        # Few enough that none of them sleeps.
        rest_s = _quickest(rank.rest, _FEW)
        time.sleep(0.01)
        sleep_s = _quickest(rank.rest, _FEW)
    found = []
    for frame, pattern in enumerate(job.patterns, 1):
        before = transport.sends, counted.messages, counted.looks, counted.rests
        transport.meet()
        spent_s, latency_s = _ask(pattern, rank, frame)
        after = transport.sends, counted.messages, counted.looks, counted.rests
        bundles, messages, looks, rests = (
            b - a for a, b in zip(before, after, strict=True)
        )
        found.append(
            PatternCost(
                spent_s=spent_s,
                messages=messages,
                bundles=bundles,
                bytes=pattern.cell_bytes * pattern.visits,
                looks=looks,
                rests=rests,
                latency_s=latency_s,
            )
        )
    report = PatternReport(
        patterns=tuple(found),
        poll_s=poll_s,
        rest_s=rest_s,
        crowd_s=crowd_s,
        sleep_s=sleep_s,
        patience_s=YIELD_S,
    )
    path = folder / f"asked-{transport.rank}.json"
    path.write_bytes(msgspec.json.encode(report))
    transport.close()
    return 0


class _Counted:
    """Be a transport, and count what is asked of it."""

    def __init__(self, inner: Transport) -> None:
        self.rank = inner.rank
        self.ranks = inner.ranks
        self.distances = inner.distances
        self.messages = self.looks = self.rests = 0
        self._inner = inner

    def send(self, message: Message) -> None:
        self.messages += message.target != self.rank
        self._inner.send(message)

    def poll(self) -> Message | None:
        found = self._inner.poll()
        self.looks += found is None
        return found

    def rest(self, waiting: bool) -> None:
        self.rests += 1
        self._inner.rest(waiting)


class _Asking(ReplayWork):
    """Miss several cells at once, then the next ones; show one pixel for it all."""

    def __init__(self, cache: CellCache, pattern: Pattern) -> None:
        super().__init__(cache, payload=bytes(pattern.cell_bytes), checks=False)
        self._asked = cache
        self._at_once = pattern.at_once

    def run(self, packets: list[Visits], clock: int) -> list[list[int] | None]:
        """Tell what is missing of the next cells."""
        return [self._missing(packet, clock) for packet in packets]

    def result(self, packet: Visits) -> bytes:
        """Write a pixel."""
        region = Region(0, 0, 1, 1)
        return region_payload(region, np.zeros((1, 4), "f4"), np.zeros(1, "f4"))

    def _missing(self, packet: Visits, clock: int) -> list[int]:
        cache = self._asked
        while packet.done < len(packet.cells):
            group = packet.cells[packet.done : packet.done + self._at_once]
            missing = [cell for cell in group if not cache.holds(cell)]
            if missing:
                return missing
            cache.stamp[[cache.slot(cell) for cell in group]] = clock
            packet.done += self._at_once
        return []


def _ask(pattern: Pattern, rank: Rank, frame: int) -> tuple[float, tuple[float, ...]]:
    """Ask homes for cells; get what it cost but for the asking, and the waits."""
    ranks, here = rank.transport.ranks, rank.transport.rank
    at_once = pattern.at_once
    home = homes(CELLS, ranks)
    cache = CellCache(2 * at_once)
    work = _Asking(cache, pattern)
    place = Directory(here, home, home, rank.transport.distances)
    node = Recording(Node(work, place, cache, migrates=False))
    others = np.flatnonzero(home != here)
    # Every cell again and again, each long after it was dropped.
    cells = np.resize(others, pattern.visits).tolist()
    rank.watch.restart()
    rank.begin(frame, node, [Visits(cells)], None if here else Gather(ranks, 1))
    while rank.is_drawing:
        if here == 0 and rank.is_complete:
            rank.end()
        elif not rank.step():
            rank.rest()
    parts = rank.watch.ledger.parts()
    return sum(parts.values()) - parts["render"], tuple(node.latency_s)


def _quickest(act: Callable[[], object], times: int) -> float:
    """Return the seconds of one, of the quickest of a few lots."""
    lots = 5
    best = float("inf")
    for _ in range(lots):
        began = time.perf_counter()
        for _ in range(times // lots):
            act()
        best = min(best, (time.perf_counter() - began) / (times // lots))
    return best


def _crowd(rank: Rank) -> float:
    """Look and yield while the other ranks do so, too; get the seconds of one.

    The median of several lots: others stop a rank in some, and in the last ones some
    ranks have ended.
    """
    lots = 10
    took = []
    for _ in range(lots):
        began = time.perf_counter()
        for _ in range(_MANY // lots):
            rank.step()
            os.sched_yield()
        took.append((time.perf_counter() - began) / (_MANY // lots))
    return float(np.median(took))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
