"""What one sample means to tasks."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from renderers.scene import Camera, Volume
from scenarios.instrument_state import NO_TOOL

if TYPE_CHECKING:
    # what edits a patient loads a compiler
    from surgery.patient import VolumeLedger


@dataclass(frozen=True, slots=True)
class Situation:
    """What tasks look at, at one moment of the score's clock.

    tip_mm: ``(3,)`` of the scope. camera: what it sees. distance: signed air distance
    of the head as it is cut, mm, negative in air. tool, tool_tip_mm, is_working: what
    the second hand does; no place without a tool. hazards_mm: how near scope or tool
    is, by hazard. edits: cuts so far, their undoing counted too. books: what was taken.
    fill: uint16, what is left of each voxel, of 65535; None where nobody operates.
    wall_mm3: bone of walls taken, by name, as of `edits`. injured: structures hurt so
    far. seen_percent: of the mucosa of sites, by name.
    """

    time_s: float
    tip_mm: NDArray[np.float64]
    camera: Camera
    distance: Volume
    tool: str = NO_TOOL
    tool_tip_mm: NDArray[np.float64] | None = None
    is_working: bool = False
    hazards_mm: Mapping[str, float] = field(default_factory=dict)
    edits: int = 0
    books: "VolumeLedger | None" = None
    fill: NDArray[np.uint16] | None = None
    wall_mm3: Mapping[str, float] = field(default_factory=dict)
    injured: frozenset[str] = frozenset()
    seen_percent: Mapping[str, float] = field(default_factory=dict)
