"""What a tool took since its pedal went down, and what it would take, in words."""

from collections.abc import Mapping

from anatomy.tissue import Label
from scenarios.instrument_state import NO_TOOL
from scenarios.instruments import INSTRUMENTS, Action

LEAST_MM3, WARNED_MM3 = 0.5, 0.1
"""Less of a tissue is not named where it was taken, and where it would be taken."""

ORGANS = frozenset(
    label.name.lower().replace("_", " ")
    for label in Label
    if label >= Label.GLOBE or label is Label.SEPTAL_CARTILAGE
)
"""What must not be hurt, as it is called where it is taken."""


def takes_tissue(name: str) -> bool:
    """Return whether a tool of the catalogue is one that takes tissue."""
    return name != NO_TOOL and INSTRUMENTS[name].action not in (
        Action.FEEL,
        Action.SUCK,
        Action.INJECT,
    )


def taken_text(before: Mapping[str, float], after: Mapping[str, float]) -> str:
    """Return what came away between two sums, mm3 by tissue: the most of it first."""
    taken = {name: mm3 - before.get(name, 0.0) for name, mm3 in after.items()}
    words = _volumes(taken, LEAST_MM3)
    return f"Taken: {words}" if words else "Nothing was taken"


def bite_text(mm3: Mapping[str, float]) -> str:
    """Return what would come away, mm3 by tissue: the most first; "" for nothing.

    What must not be hurt is named however little it is.
    """
    return _volumes(mm3, WARNED_MM3)


def _volumes(mm3: Mapping[str, float], least_mm3: float) -> str:
    named = [
        (most, name)
        for name, most in mm3.items()
        if most >= least_mm3 or (most > 0.0 and name in ORGANS)
    ]
    return ", ".join(
        f"{name} {most:.0f} mm³" if most >= LEAST_MM3 else f"{name} < 1 mm³"
        for most, name in sorted(named)[::-1]
    )
