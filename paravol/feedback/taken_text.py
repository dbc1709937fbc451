"""What a tool took since its pedal went down, in words."""

from collections.abc import Mapping

from scenarios.instrument_state import NO_TOOL
from scenarios.instruments import INSTRUMENTS, Action

LEAST_MM3 = 0.5
"""Less of a tissue is not named."""


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
    named = [(mm3, name) for name, mm3 in taken.items() if mm3 >= LEAST_MM3]
    if not named:
        return "Nothing was taken"
    words = [f"{name} {mm3:.0f} mm³" for mm3, name in sorted(named, reverse=True)]
    return f"Taken: {', '.join(words)}"
