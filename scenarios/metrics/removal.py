"""What was taken, against what the task wanted taken and spared."""

from collections.abc import Collection

from scenarios.metrics.measured import Measured
from scenarios.metrics.metric import PATIENT, Answer, Definition, Found, Interval

NOBODY = "nobody operated"
NOT_WANTED = "no task asks for a volume of tissue"
NOT_PROTECTED = "the task does not say what to spare"


def taken_mm3(measured: Measured) -> dict[str, float]:
    """Return what was taken, by tissue."""
    total: dict[str, float] = {}
    for edit in measured.edits or ():
        for tissue, mm3 in edit.taken_mm3.items():
            total[tissue] = total.get(tissue, 0.0) + mm3
    return total


def removed(measured: Measured) -> Answer:
    """Return the volume taken, in all and by tissue, mm3."""
    if measured.edits is None:
        return {"in all": Found(None, (), NOBODY)}
    taken = taken_mm3(measured)
    answer = {"in all": Found(sum(taken.values()), _moments(measured, taken))}
    for tissue, mm3 in sorted(taken.items(), key=lambda item: -item[1]):
        answer[tissue] = Found(mm3, _moments(measured, (tissue,)))
    return answer


def wanted_share(measured: Measured) -> Found:
    """Return the share of the wanted volume that was taken.

    More of a tissue than was wanted does not make up for less of another.
    """
    wanted = measured.settings.wanted_mm3
    if measured.edits is None:
        return Found(None, (), NOBODY)
    if not sum(wanted.values()) > 0.0:
        return Found(None, (), NOT_WANTED)
    taken = taken_mm3(measured)
    got = sum(min(taken.get(name, 0.0), mm3) for name, mm3 in wanted.items())
    return Found(got / sum(wanted.values()), _moments(measured, wanted))


def fitting_share(measured: Measured) -> Found:
    """Return the share of what was taken that was wanted."""
    wanted = measured.settings.wanted_mm3
    if measured.edits is None:
        return Found(None, (), NOBODY)
    if not wanted:
        return Found(None, (), NOT_WANTED)
    taken = taken_mm3(measured)
    whole = sum(taken.values())
    if not whole > 0.0:
        return Found(None, (), "nothing was taken")
    got = sum(min(taken.get(name, 0.0), mm3) for name, mm3 in wanted.items())
    return Found(got / whole, _moments(measured, taken))


def protected_share(measured: Measured) -> Found:
    """Return the share of the protected tissue that was taken."""
    protected = measured.settings.protected_mm3
    if measured.edits is None:
        return Found(None, (), NOBODY)
    if not sum(protected.values()) > 0.0:
        return Found(None, (), NOT_PROTECTED)
    taken = taken_mm3(measured)
    lost = sum(min(taken.get(name, 0.0), mm3) for name, mm3 in protected.items())
    return Found(lost / sum(protected.values()), _moments(measured, protected))


def _moments(measured: Measured, tissues: Collection[str]) -> tuple[Interval, ...]:
    """Return when something of these tissues was taken."""
    return tuple(
        (edit.time_s, edit.time_s)
        for edit in measured.edits or ()
        if any(edit.taken_mm3.get(tissue, 0.0) > 0.0 for tissue in tissues)
    )


REMOVAL = (
    Definition("tissue removed", PATIENT, "mm3", removed),
    Definition("wanted tissue removed", PATIENT, "1", wanted_share),
    Definition("removed tissue that was wanted", PATIENT, "1", fitting_share),
    Definition("protected tissue removed", PATIENT, "1", protected_share),
)
