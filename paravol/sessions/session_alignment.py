"""Which moment of one session belongs to which of another: a map by landmarks.

Both sessions are looked through for what they have in common: when the scope came
nearest to each landmark, and what happened to each task. What came in the same order in
both ties their times together; between two ties time runs evenly.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scenarios.bundle import EventRecord, Recording

NEAR_MM = 10.0
"""A scope that stays farther away did not visit a landmark."""

DEPARTED_MM = 1.0
"""A scope was so much farther away before and after; else it began or ended there."""


class Mark(NamedTuple):
    """When something was reached, and how near it, mm; 0 for an event."""

    time_s: float
    distance_mm: float


class TimeMap(NamedTuple):
    """Tie the times of two sessions together, monotone and linear between the ties.

    here_s, there_s: ``(n,)`` strictly rising: the first samples, what was reached in
    both, the last samples. names: of what was reached, in order.
    """

    here_s: NDArray[np.float64]
    there_s: NDArray[np.float64]
    names: tuple[str, ...]

    def at(self, time_s: float) -> float:
        """Return the other session's time of a time here, held within both."""
        return float(np.interp(time_s, self.here_s, self.there_s))


def by_time(here_s: tuple[float, float], there_s: tuple[float, float]) -> TimeMap:
    """Return the map that ties equal times since the first samples.

    here_s, there_s: times of the first and the last sample; the longer session is only
    mapped as far as the shorter one lasts.
    """
    lasts_s = min(here_s[1] - here_s[0], there_s[1] - there_s[0])
    lasts_s = max(lasts_s, 1e-9)
    here, there = (np.array([s, s + lasts_s]) for s in (here_s[0], there_s[0]))
    return TimeMap(here, there, ())


def session_marks(
    recording: Recording, landmarks: Mapping[str, NDArray[np.float64]]
) -> dict[str, Mark]:
    """Return when a session reached what, by name.

    landmarks: ``(3,)`` LPS mm of the flown head's, by name.
    """
    samples = recording.samples
    marks: dict[str, Mark] = {}
    if samples:
        matrix = np.array(recording.info.world_from_device).reshape(4, 4)
        times = np.maximum.accumulate([r.time_s for r in samples])
        tips = np.array([r.device_from_tip for r in samples]).reshape(-1, 4, 4)
        tips = tips[:, :3, 3] @ matrix[:3, :3].T + matrix[:3, 3]
        for name, position in landmarks.items():
            away = np.linalg.norm(tips - position, axis=1)
            nearest = int(np.argmin(away))
            near_mm = float(away[nearest])
            departed_mm = min(away[: nearest + 1].max(), away[nearest:].max()) - near_mm
            if near_mm <= NEAR_MM and departed_mm >= DEPARTED_MM:
                marks[name] = Mark(float(times[nearest]), near_mm)
    for record in recording.records:
        if isinstance(record, EventRecord) and record.kind == "task":
            marks.setdefault(f"task {record.text}", Mark(record.time_s, 0.0))
    return marks


def align(
    here: Mapping[str, Mark],
    there: Mapping[str, Mark],
    here_s: tuple[float, float],
    there_s: tuple[float, float],
) -> TimeMap:
    """Return the map between two sessions; exchanged, they give the inverse map.

    here_s, there_s: times of the first and the last sample. The longest chain of marks
    that come in the same order in both is tied; of several the one that was come
    nearest to.
    """
    shared = [
        name
        for name in sorted(here.keys() & there.keys())
        if here_s[0] < here[name].time_s < here_s[1]
        and there_s[0] < there[name].time_s < there_s[1]
    ]
    shared.sort(key=lambda name: (here[name].time_s, there[name].time_s))
    # the best chain that ends with each mark: number, nearness and names
    chains: list[tuple[int, float, tuple[str, ...]]] = []
    for i, name in enumerate(shared):
        best: tuple[int, float, tuple[str, ...]] = (0, 0.0, ())
        for before, chain in zip(shared[:i], chains, strict=True):
            if _comes_before(before, name, here, there) and _rank(chain) < _rank(best):
                best = chain
        away = here[name].distance_mm + there[name].distance_mm
        chains.append((best[0] + 1, best[1] + away, (*best[2], name)))
    names = min(chains, key=_rank)[2] if chains else ()
    return TimeMap(
        np.array([here_s[0], *(here[n].time_s for n in names), here_s[1]]),
        np.array([there_s[0], *(there[n].time_s for n in names), there_s[1]]),
        names,
    )


def _rank(chain: tuple[int, float, tuple[str, ...]]) -> tuple[object, ...]:
    count, away_mm, names = chain
    return -count, away_mm, names


def _comes_before(
    first: str, second: str, here: Mapping[str, Mark], there: Mapping[str, Mark]
) -> bool:
    return (
        here[first].time_s < here[second].time_s
        and there[first].time_s < there[second].time_s
    )
