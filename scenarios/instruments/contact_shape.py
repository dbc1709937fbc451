"""What of a tool meets tissue: its capsules as a table, and where its shaft runs."""

from functools import lru_cache

import numpy as np

from scenarios.instrument_state import NO_TOOL
from scenarios.instruments.catalogue import instrument_named, parts_of
from scenarios.instruments.parts import Doubles

CHECKED_MM = 110.0
"""Length of a tool that is kept clear of tissue: the whole nasal passage."""

CARRIED_MM = 10.0
"""Of a tool that is carried before the lens only so much is real: nobody holds the rest
of it, and no nostril would let it through."""

SHAFT_AT_MM = 50.0
"""There every tool of the catalogue is straight, and in or near the nostril."""


HALF_OPEN, ASIDE_MM = 0.25, 1.0
"""Jaws that are closed so far work in the middle between them; what works farther off
the shaft works beside it."""

JAW_STEPS = 16
"""Jaws are looked at so finely: a step moves the end of the longest by 0.5 mm."""


def contact_table(name: str, jaw: float, length_mm: float = CHECKED_MM) -> Doubles:
    """Return a tool's capsules, ``(n, 7)`` start, end and radius in its own frame.

    jaw: 0 open to 1 closed, in steps of `JAW_STEPS`. length_mm: what lies farther back
    is left out. Read-only.
    """
    return _table(name, round(jaw * JAW_STEPS) / JAW_STEPS, length_mm)


@lru_cache(maxsize=256)
def _table(name: str, jaw: float, length_mm: float) -> Doubles:
    """Return the table of a jaw of whole steps."""
    table = instrument_named(name).capsules(np.eye(4), jaw).table()
    rows = []
    for row in table:
        start, end = row[:3], row[3:6]
        if start[2] > end[2]:
            start, end = end, start
        if start[2] >= length_mm:
            continue
        if end[2] > length_mm:
            share = (length_mm - start[2]) / (end[2] - start[2])
            end = start + share * (end - start)
        rows.append(np.concatenate([start, end, row[6:]]))
    made = np.array(rows).reshape(-1, 7)
    made.flags.writeable = False
    return made


def placed_table(table: Doubles, world_from_tool: Doubles) -> Doubles:
    """Move the rows of `contact_table` by a rigid 4x4 pose."""
    turn, origin = world_from_tool[:3, :3].T, world_from_tool[:3, 3]
    ends = table[:, :3] @ turn + origin, table[:, 3:6] @ turn + origin
    return np.concatenate([*ends, table[:, 6:]], axis=1)


@lru_cache(maxsize=64)
def shaft_mm(name: str) -> Doubles:
    """Return where a tool's straight shaft meets the plane of its tip, ``(3,)``.

    In the tool's frame; the tip of a bent tool lies beside its shaft. Read-only.
    """
    shaft = parts_of(instrument_named(name))[0].capsules
    low = np.minimum(shaft.start_mm[:, 2], shaft.end_mm[:, 2])
    high = np.maximum(shaft.start_mm[:, 2], shaft.end_mm[:, 2])
    at = int(np.argmax((low <= SHAFT_AT_MM) & (high > SHAFT_AT_MM)))
    start, end = shaft.start_mm[at], shaft.end_mm[at]
    share = (SHAFT_AT_MM - start[2]) / (end[2] - start[2])
    place: Doubles = start + share * (end - start)
    place[2] = 0.0
    place.flags.writeable = False
    return place


@lru_cache(maxsize=64)
def works_at_mm(name: str) -> Doubles:
    """Return where a tool works beside its shaft, ``(3,)`` in its own frame.

    Zeros for one that works at its tip, and for no tool. Read-only.
    """
    place = np.zeros(3)
    if name != NO_TOOL:
        rows = instrument_named(name).working_volume(np.eye(4), HALF_OPEN)
        ends = rows[:, 1:7].reshape(-1, 3)
        if len(ends) and ends[:, 1].mean() > ASIDE_MM:
            place[1:] = ends[:, 1:].mean(axis=0)
    place.flags.writeable = False
    return place
