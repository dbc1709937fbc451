"""What metrics are computed from: tracks, gaps, edits, injuries, targets."""

from bisect import bisect_right
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from scenarios.coverage.patches import Mucosa
from scenarios.coverage.watch import CoverageFigures
from scenarios.endoscope import Endoscope
from scenarios.metrics.metric import SCOPE, Interval
from scenarios.metrics.settings import Settings
from scenarios.metrics.track import Piece, Track

if TYPE_CHECKING:
    from scenarios.metrics.cavity import Cavity

Doubles = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Contacts:
    """The scope's gap to tissue, mm, ``(n,)``, negative in it, and what is there.

    touched: ``(n,)`` places in names, -1 without contact. names: of structures.
    """

    time_s: Doubles
    gap_mm: Doubles
    touched: NDArray[np.int64]
    names: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class HazardGaps:
    """The gaps of a tool to each hazard, mm, ``(n,)``, negative inside.

    time_s: ``(n,)``. gap_mm: by hazard; NaN where the tool was not there. farthest_mm:
    larger gaps are not known.
    """

    time_s: Doubles
    gap_mm: Mapping[str, Doubles]
    farthest_mm: float = np.inf


@dataclass(frozen=True, slots=True)
class Taken:
    """What one cut took; see `surgery.edit.Edit`."""

    time_s: float
    tool: str
    taken_mm3: Mapping[str, float]


@dataclass(frozen=True, slots=True)
class ToolUse:
    """When tools worked or sucked: ``(n,)`` by name, at times ``(n,)`` s."""

    time_s: Doubles
    is_used: Mapping[str, NDArray[np.bool_]]


@dataclass(frozen=True, slots=True)
class Breach:
    """An injury: a tool that entered a hazard, found on its swept way."""

    time_s: float
    structure: str
    by: str
    depth_mm: float


@dataclass(frozen=True, slots=True)
class Reference:
    """The shortest way that the scope could have gone between two moments."""

    length_mm: float
    begin_s: float
    end_s: float


@dataclass(frozen=True)
class Measured:
    """All that metrics of a session are computed from; patient LPS, mm, s.

    scope, tool: tracks of the scope and of what the second hand holds; a scope's y axis
    is its light post. endoscope: its angle and field. contacts, hazards, tool_hazards:
    None where the head was not measured. edits, breaches: None where nobody operated.
    targets: places ``(3,)`` by name. reference: the shortest way through the air, by
    the targets; None where it is unknown. expert: the scope's track in a session to
    compare with, None without one. coverage: what mucosa was seen, None where nobody
    watched. picture_px: width of the picture. scope_changes: when a scope of another
    angle was put in, s, and that angle, in order. tool_use: of the second hand, None
    where nobody recorded it. allowed_tools: that the exercise lists; none: all. mucosa:
    of the head before any cut. cavity, expert_cavity: what was taken in the end, None
    where nobody operated, or there is nobody to compare with.
    """

    scope: Track
    tool: Track
    endoscope: Endoscope = field(default_factory=Endoscope)
    targets: Mapping[str, Doubles] = field(default_factory=dict)
    contacts: Contacts | None = None
    hazards: HazardGaps | None = None
    tool_hazards: HazardGaps | None = None
    edits: tuple[Taken, ...] | None = None
    breaches: tuple[Breach, ...] | None = None
    reference: Reference | None = None
    expert: Track | None = None
    coverage: CoverageFigures | None = None
    picture_px: int = 512
    scope_changes: tuple[tuple[float, float], ...] = ()
    tool_use: ToolUse | None = None
    allowed_tools: tuple[str, ...] = ()
    mucosa: Mucosa | None = None
    cavity: "Cavity | None" = None
    expert_cavity: "Cavity | None" = None
    settings: Settings = field(default_factory=Settings)

    @cached_property
    def scope_pieces(self) -> list[Piece]:
        """Return the scope's evenly sampled, low-passed pieces."""
        return self.scope.pieces(self.settings)

    @cached_property
    def tool_pieces(self) -> list[Piece]:
        """Return the tool's evenly sampled, low-passed pieces."""
        return self.tool.pieces(self.settings)

    def endoscope_of(self, piece: Piece) -> Endoscope:
        """Return the scope that was in hand over a piece of its track."""
        changes = self.scope_changes
        place = bisect_right(changes, piece.begin_s, key=lambda change: change[0])
        return self.endoscope.at(changes[place - 1][1] if place else None)

    def track(self, role: str) -> Track:
        """Return the track of a role."""
        return self.scope if role == SCOPE else self.tool

    def pieces(self, role: str) -> list[Piece]:
        """Return the pieces of a role."""
        return self.scope_pieces if role == SCOPE else self.tool_pieces

    def spans(self, role: str) -> tuple[Interval, ...]:
        """Return the seconds in which a role's tool was measured."""
        track = self.track(role)
        return tuple(
            (float(track.time_s[places[0]]), float(track.time_s[places[-1]]))
            for places in track.spans(self.settings.gap_s)
            if len(places) > 1
        )
