"""What a session measured at a sample: the ground of all that is said of a flight."""

from typing import TYPE_CHECKING

import msgspec

if TYPE_CHECKING:
    from scenarios.session import ScopeReading


class Reading(
    msgspec.Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True
):
    """What a session measured at one sample, mm; see `ScopeReading`.

    gap_mm: of the scope's shaft to tissue, negative in it; touched: the structure, ""
    without contact. hazards_mm: gap of the scope's shaft to each hazard. tool_hazards:
    of the tool's tip, None without a tool. tool_mm: the tool's gap to tissue, None
    without one; tool_touched: what it touches without working. drags_mm: how far scope
    and tool are off their places in the nostril.
    """

    gap_mm: float
    touched: str = ""
    hazards_mm: dict[str, float] | None = None
    tool_hazards_mm: dict[str, float] | None = None
    tool_mm: float | None = None
    tool_touched: str = ""
    drags_mm: dict[str, float] = {}

    @classmethod
    def of(cls, placed: "ScopeReading") -> "Reading":
        """Take what was measured. Floats keep all their bits."""
        hazards = placed.hazards
        return cls(
            placed.gap_mm,
            placed.touched,
            None if hazards is None else hazards.shaft,
            None if hazards is None else hazards.instrument,
            placed.tool_mm,
            placed.tool_touched,
            placed.drags_mm,
        )
