"""How near the tools came to what must not be hurt."""

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from anatomy.hazard_volumes import HazardLine, HazardVolumes

ALWAYS_NEAR = frozenset(("septum",))
"""What a scope glides along in every nose: never named as the nearest hazard."""

STEP_MM = 0.25
"""Between places along a shaft where distances are read: they change by at most 1 mm
per mm, so half of this is the most that is missed."""


@dataclass(frozen=True, slots=True)
class HazardApproach:
    """The nearest approach to one hazard, mm, and when it was, s; negative inside.

    tip: of the middle of the scope's end face. shaft: of the scope's surface.
    instrument: of the tip of the tool in the second hand, None where none was held.
    """

    tip_mm: float
    tip_s: float
    shaft_mm: float
    shaft_s: float
    instrument_mm: float | None = None
    instrument_s: float | None = None

    @property
    def nearest_mm(self) -> float:
        """Return how near the nearest of all came."""
        return min(self.tip_mm, self.shaft_mm, self.tool_mm)

    @property
    def tool_mm(self) -> float:
        """Return how near the tool came, inf where none was held."""
        return math.inf if self.instrument_mm is None else self.instrument_mm


@dataclass(frozen=True, slots=True)
class HazardGaps:
    """One moment's distances in mm by hazard; instrument: None without a tool."""

    tip: dict[str, float]
    shaft: dict[str, float]
    instrument: dict[str, float] | None

    def nearest_mm(self) -> dict[str, float]:
        """Return how near scope or tool is, by hazard."""
        found = dict(self.shaft)
        for name, gap in (self.instrument or {}).items():
            found[name] = min(found[name], gap)
        return found

    def nearest(self) -> tuple[str, float] | None:
        """Return the hazard that a tool is nearest to, and how near; None for none."""
        found = self.nearest_mm()
        named = [name for name in found if name not in ALWAYS_NEAR]
        if not named:
            return None
        name = min(named, key=found.__getitem__)
        return name, found[name]


def hazard_gaps(
    hazards: HazardVolumes,
    world_from_tip: NDArray[np.float64],
    radius_mm: float,
    length_mm: float,
    instrument_tip_mm: NDArray[np.float64] | None,
) -> HazardGaps:
    """Measure the tools of one moment.

    world_from_tip: 4x4 of a straight shaft, as for `shaft_clearance`: a capsule whose
    end sphere is centred one radius behind the tip. instrument_tip_mm: ``(3,)``, None
    without a tool.
    """
    tip, back = world_from_tip[:3, 3], world_from_tip[:3, 2]
    count = max(int((length_mm - radius_mm + STEP_MM / 2) / STEP_MM) + 1, 1)
    begin = tip + radius_mm * back
    step = STEP_MM * back
    lines = [HazardLine(tip, step, 1), HazardLine(begin, step, count)]
    if instrument_tip_mm is not None:
        lines.append(HazardLine(instrument_tip_mm, step, 1))
    at_tip, axis, *instrument = hazards.along_mm(lines)
    shaft = {name: gap - radius_mm for name, gap in axis.items()}
    return HazardGaps(at_tip, shaft, instrument[0] if instrument else None)


@dataclass(slots=True)
class HazardWatch:
    """Keep the nearest approaches, sample by sample."""

    _nearest: dict[str, HazardApproach] = field(default_factory=dict)

    def add(self, time_s: float, gaps: HazardGaps) -> None:
        """Take in one moment."""
        for name, shaft_mm in gaps.shaft.items():
            tip = gaps.tip[name], time_s
            shaft = shaft_mm, time_s
            tool: tuple[float | None, float | None] = None, None
            if gaps.instrument is not None:
                tool = gaps.instrument[name], time_s
            old = self._nearest.get(name)
            if old is not None:
                # by far most moments are no approach
                is_nearer = tip[0] < old.tip_mm or shaft_mm < old.shaft_mm
                if not is_nearer and not _distance(tool) < old.tool_mm:
                    continue
                tip = min((old.tip_mm, old.tip_s), tip, key=_distance)
                shaft = min((old.shaft_mm, old.shaft_s), shaft, key=_distance)
                tool = min((old.instrument_mm, old.instrument_s), tool, key=_distance)
            self._nearest[name] = HazardApproach(*tip, *shaft, *tool)

    def copy(self) -> "HazardWatch":
        """Return a watch that knows the same and goes on by itself."""
        return HazardWatch(dict(self._nearest))

    def approaches(self) -> dict[str, HazardApproach]:
        """Return the nearest approaches so far, by hazard."""
        return dict(self._nearest)


def _distance(found: tuple[float | None, float | None]) -> float:
    return math.inf if found[0] is None else found[0]
