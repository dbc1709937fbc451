"""What the second hand does: which tool it holds, and what it presses."""

from dataclasses import dataclass

NO_TOOL = ""
"""Name of the tool of an empty hand."""

FIRST_TOOL = "suction tube"
"""The tool of recordings from before tools had names."""


@dataclass(frozen=True, slots=True)
class InstrumentState:
    """The state of the tool beside the scope, as it was recorded.

    name: of the catalogue, `NO_TOOL` for an empty hand. roll_deg: turn about the tool's
    axis, right-handed about where it points. jaw: 0 open to 1 closed. is_working: its
    pedal is down: a jaw closes, a blade or a debrider cuts. is_sucking: suction is on.
    undone: strokes that the trainee has taken back so far. washed: times the lens was
    washed so far. is_carried: no device holds it; it goes before the lens.
    """

    name: str = FIRST_TOOL
    roll_deg: float = 0.0
    jaw: float = 0.0
    is_working: bool = False
    is_sucking: bool = False
    undone: int = 0
    washed: int = 0
    is_carried: bool = False


EMPTY_HAND = InstrumentState(NO_TOOL)

AS_BEFORE = InstrumentState()
"""The state in recordings from before tools did anything."""
