"""What a host's messages and waiting cost, learned from runs that draw nothing."""

import os
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
from scipy.optimize import nnls

from benchmarks.ranks.message_costs import (
    CELL_BYTES,
    Pattern,
    PatternCost,
    PatternJob,
    PatternReport,
    run_patterns,
)
from benchmarks.ranks.mpi_frames import RankJob, busy_s, run_ranks
from benchmarks.simulated_ranks.host import HostCosts
from renderers.art.ranks.messages import Message, MessageKind
from renderers.art.regions import Gather, Region, region_payload

PATTERNS = tuple(
    Pattern(visits=320, at_once=at_once, cell_bytes=size)
    for at_once, size in (
        (1, 64),
        (1, CELL_BYTES),
        (4, CELL_BYTES),
        (16, CELL_BYTES),
        (16, 64),
        (1, 20_000),
        (4, 20_000),
    )
)
"""Bundles of one message and of many, without payload, with a cell's, with a region's:
what a message costs, what a bundle, what a byte."""

ROUNDS = 5

_LOTS = 15
"""Of short patterns, tried in turn: some lot of each is not disturbed by others."""

_TIMES = 200


def real_time() -> tuple[str, ...]:
    """Return the words that start a command at real-time priority, where allowed."""
    try:
        os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(1))
    except (AttributeError, PermissionError):
        return ()
    os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
    return ("chrt", "-r", "1")


def learn_host(folder: Path, *launcher: str) -> HostCosts:
    """Measure two ranks that only ask, and twice as many as processors that wait.

    What depends on the pictures is left out: frame_s, packet_s and busy.
    """
    reports = run_patterns(
        2, PatternJob(patterns=PATTERNS * _LOTS, waits=True), folder, *launcher
    )
    poll_s = min(report.poll_s for report in reports)
    rest_s = min(report.rest_s for report in reports)
    message_s, bundle_s, byte_s = fit_messages(reports, poll_s, rest_s)
    cores = len(os.sched_getaffinity(0))
    crowd = run_patterns(2 * cores, PatternJob(waits=True), folder, *launcher)
    # Of two ranks a processor each waits for the other's look and yield.
    turn_s = min(report.crowd_s for report in crowd) / 2
    switch_s = max(turn_s - min(report.crowd_s for report in reports), 0.0)
    codec_s = _quickest(_there_and_back)
    return HostCosts(
        message_s=message_s,
        own_s=max(message_s - codec_s, 0.0),
        bundle_s=bundle_s,
        byte_s=byte_s,
        gather_s=_gather_s(),
        poll_s=poll_s,
        rest_s=rest_s,
        switch_s=switch_s,
        sleep_s=min(report.sleep_s for report in reports),
        patience_s=reports[0].patience_s,
        latency_s=1e-6,
    )


def fit_messages(
    reports: Sequence[PatternReport], poll_s: float, rest_s: float
) -> tuple[float, float, float]:
    """Find what a message, a bundle and a byte cost by each pattern's quickest."""
    rows, seconds = [], []
    for number in range(len(PATTERNS)):
        tried = [
            [report.patterns[k] for report in reports]
            for k in range(number, len(reports[0].patterns), len(PATTERNS))
        ]
        best = min(tried, key=lambda parts: _net_s(parts, poll_s, rest_s))
        rows.append(
            [
                sum(part.messages for part in best),
                sum(part.bundles for part in best),
                sum(part.bytes for part in best),
            ]
        )
        seconds.append(_net_s(best, poll_s, rest_s))
    # Each pattern counts alike, however long it takes.
    scaled = np.array(rows, float) / np.array(seconds)[:, None]
    size = scaled.max(axis=0)
    found, _ = nnls(scaled / size, np.ones(len(seconds)))
    message_s, bundle_s, byte_s = (found / size).tolist()
    return message_s, bundle_s, byte_s


def contention_factor(job: RankJob, folder: Path, *launcher: str) -> float:
    """Find how many times as long work takes while another process works.

    Each draws all of the job by itself, and says nothing to the other.
    """
    alone = _best_busy_s(job, folder, *launcher)
    folders = []
    for name in ("one", "other"):
        part = folder / name
        part.mkdir(exist_ok=True)
        if not (part / "data").exists():
            (part / "data").symlink_to(folder / "data")
        folders.append(part)

    def draw(part: Path) -> float:
        return _best_busy_s(job, part, *launcher)

    with ThreadPoolExecutor() as pool:
        together = list(pool.map(draw, folders))
    return max(sum(together) / len(together) / alone, 1.0)


def _best_busy_s(job: RankJob, folder: Path, *launcher: str) -> float:
    reports = run_ranks(1, job, folder, *launcher)
    return min(busy_s(reports, number) for number in range(job.rounds))


def _net_s(parts: Sequence[PatternCost], poll_s: float, rest_s: float) -> float:
    """Return the seconds of all ranks without those of looking in vain."""
    return sum(p.spent_s - p.looks * poll_s - p.rests * rest_s for p in parts)


def _gather_s() -> float:
    side = 64
    region = Region(0, 0, side, side)
    payload = region_payload(
        region, np.zeros((side * side, 4), "f4"), np.zeros(side * side, "f4")
    )
    best = float("inf")
    for _ in range(_TIMES):
        gather = Gather(side, side)
        began = time.perf_counter()
        gather.add_payload(payload)
        best = min(best, time.perf_counter() - began)
    return best / len(payload)


def _there_and_back() -> None:
    Message.decode(Message(MessageKind.REQUEST, 0, 1, 1).encode())


def _quickest(act: Callable[[], object]) -> float:
    best = float("inf")
    for _ in range(_TIMES):
        began = time.perf_counter()
        act()
        best = min(best, time.perf_counter() - began)
    return best
