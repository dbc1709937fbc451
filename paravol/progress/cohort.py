"""Trainees beside one another: what each reached in each exercise."""

from collections.abc import Sequence
from dataclasses import dataclass
from statistics import median

from paravol.progress.session_entry import PERCENT, SessionEntry

GROWING = (
    *(PERCENT, "economy of motion", "SPARC", "LDLJ", "centred share", "tool in view"),
    *("wanted tissue removed", "removed tissue that was wanted"),
    *("smallest distance", "bimanual dexterity"),
)
"""Beginnings of the names of figures of which more is better; of others less is."""


@dataclass(frozen=True, slots=True)
class Standing:
    """How a trainee stands in an exercise.

    attempts: sessions. judged: those of which somebody says whether they were passed.
    passes: of them. best, middle: of the figure, None where no session has it.
    percentile: of the middle among those of all trainees in this exercise, 100 the
    best; None for a trainee alone. last_seen: UTC.
    """

    trainee: str
    exercise: str
    attempts: int
    judged: int
    passes: int
    best: float | None
    middle: float | None
    percentile: float | None
    unit: str
    last_seen: str


def is_more_better(figure: str) -> bool:
    """Return whether a larger figure is a better one."""
    return figure.startswith(GROWING)


def standings(
    entries: Sequence[SessionEntry], figure: str, role: str = ""
) -> list[Standing]:
    """Return a row for each trainee in each exercise, in order of both.

    figure, role: as `SessionEntry.value` takes them.
    """
    groups: dict[tuple[str, str], list[SessionEntry]] = {}
    for entry in entries:
        groups.setdefault((entry.exercise, entry.trainee), []).append(entry)
    sign = 1.0 if is_more_better(figure) else -1.0
    found = {
        key: [v for entry in group if (v := entry.value(figure, role)) is not None]
        for key, group in groups.items()
    }
    figures = {
        key: [v.value for v in values if v.value is not None]
        for key, values in found.items()
    }
    middles = {key: median(known) for key, known in figures.items() if known}
    rows = []
    for key in sorted(groups):
        exercise, trainee = key
        group, known = groups[key], figures[key]
        others = [sign * m for k, m in middles.items() if k[0] == exercise]
        percentile = None
        if key in middles and len(others) > 1:
            # here, as statistics take a second to load
            from scipy.stats import percentileofscore

            own = sign * middles[key]
            percentile = float(percentileofscore(others, own, kind="mean"))
        judged = [e.has_passed for e in group if e.has_passed is not None]
        rows.append(
            Standing(
                trainee,
                exercise,
                len(group),
                len(judged),
                sum(judged),
                sign * max(sign * f for f in known) if known else None,
                middles.get(key),
                percentile,
                found[key][0].unit if found[key] else "",
                max(entry.begun for entry in group),
            )
        )
    return rows
