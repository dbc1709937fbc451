"""Which exercises are open to a trainee, by what was passed before.

An exercise opens others once its benchmark is met with confidence, not by one lucky
run: the lower bound of the pass rate over the last `LAST_RUNS` runs must reach
`LEAST_RATE`. The bound is Clopper and Pearson's (Biometrika 26, 1934): the rate at
which so many passes or more would be met with probability 1 - `CONFIDENCE`. A trainee
whose true rate is below `LEAST_RATE` so opens a door by luck with at most that
probability at each look; `false_unlock` gives it for who tries again and again.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from scipy.special import betaincinv

from scenarios.scenario import Scenario

LAST_RUNS = 6
"""Older runs are those of somebody who has learnt since."""

LEAST_RATE = 0.5
CONFIDENCE = 0.85
"""Three passes in a row open a door, or five out of six."""


class ExerciseStatus(StrEnum):
    """How an exercise stands for a trainee."""

    LOCKED = "locked"
    OPEN = "open"
    PASSED = "passed"


@dataclass(frozen=True, slots=True)
class LadderStep:
    """One exercise of a ladder.

    passes, runs: of the last `LAST_RUNS`. bound: of the pass rate, from below. waits:
    names of exercises to be passed before.
    """

    name: str
    door: ExerciseStatus
    passes: int
    runs: int
    bound: float
    waits: tuple[str, ...] = ()


def rungs(
    exercises: Iterable[Scenario], results: Mapping[str, Sequence[bool]]
) -> list[LadderStep]:
    """Return how each exercise stands, in their order.

    results: whether each run was passed, in order of time, by the exercise's name.
    """
    exercises = list(exercises)
    passed = {e.name for e in exercises if is_mastered(results.get(e.name, ()))}
    found = []
    for exercise in exercises:
        last = list(results.get(exercise.name, ()))[-LAST_RUNS:]
        waits = tuple(name for name in exercise.needs if name not in passed)
        door = ExerciseStatus.LOCKED if waits else ExerciseStatus.OPEN
        if exercise.name in passed:
            door = ExerciseStatus.PASSED
        bound = lower_bound(sum(last), len(last))
        found.append(
            LadderStep(exercise.name, door, sum(last), len(last), bound, waits)
        )
    return found


def is_mastered(results: Sequence[bool]) -> bool:
    """Return whether the last runs meet the benchmark with confidence."""
    last = list(results)[-LAST_RUNS:]
    return lower_bound(sum(last), len(last)) >= LEAST_RATE


def lower_bound(passes: int, runs: int, confidence: float = CONFIDENCE) -> float:
    """Return Clopper and Pearson's one-sided lower bound of a pass rate."""
    if passes == 0:
        return 0.0
    return float(betaincinv(passes, runs - passes + 1, 1.0 - confidence))


def false_unlock(rate: float, runs: int) -> float:
    """Return how probably the benchmark is met at least once within so many runs.

    It is looked at after each of them. Exact: a chain over the last results.
    """
    chances: dict[tuple[bool, ...], float] = {(): 1.0}
    met = 0.0
    for _ in range(runs):
        after: dict[tuple[bool, ...], float] = {}
        for last, chance in chances.items():
            for result, share in ((True, rate), (False, 1.0 - rate)):
                now = (*last, result)[-LAST_RUNS:]
                if is_mastered(now):
                    met += chance * share
                else:
                    after[now] = after.get(now, 0.0) + chance * share
        chances = after
    return float(np.clip(met, 0.0, 1.0))
