"""What the trainee's window says in words and figures."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from scenarios import InstrumentState
from scenarios.instrument_state import NO_TOOL
from scenarios.instruments import instrument_named
from scenarios.nostril import STIFFNESS_N_MM
from scenarios.scoring import PRESSURE_MM

if TYPE_CHECKING:
    # what watches for injuries loads a compiler
    from surgery.injury import Injury

NEAR_MM = 0.5
"""Clearance below which the scope is about to touch: a hand's tremor is a fifth."""

FREE_MM = 50.0
"""Clearance of a scope that is outside the head: how far out is of no interest."""

UNKNOWN = "--"

NO_LABELS = "unknown (no labels)"
"""What is said of a head in which nobody has marked what must not be hurt."""

HAZARD_FAR_MM = 20.0
"""Farther away a hazard's distance is of no interest."""


@dataclass(frozen=True, slots=True)
class Readings:
    """Gather the figures of one moment; those that are not known yet are None.

    clearance_mm: gap between the scope's shaft and tissue, negative inside it.
    pose_age_ms: from the arm's measurement to the finished picture.
    registration_mm: residual of the touched fiducials, rms.
    hazard: the nearest hazard and how near a tool is, mm. has_hazards: whether the
    head's hazards are known. drags_mm: how far "scope" and "tool" are off their places
    in the nostril; none that is in no nostril.
    """

    fps: float | None = None
    pose_age_ms: float | None = None
    clearance_mm: float | None = None
    time_s: float | None = None
    registration_mm: float | None = None
    hazard: tuple[str, float] | None = None
    has_hazards: bool = True
    drags_mm: Mapping[str, float] = field(default_factory=dict)

    @property
    def is_contact(self) -> bool:
        """Return whether the scope is in tissue."""
        return self.clearance_mm is not None and self.clearance_mm < 0.0

    @property
    def is_pressing(self) -> bool:
        """Return whether the scope presses into tissue, and does not only touch it."""
        return self.clearance_mm is not None and self.clearance_mm < -PRESSURE_MM

    @property
    def is_alarming(self) -> bool:
        """Return whether the scope touches or is about to."""
        return self.clearance_mm is not None and self.clearance_mm < NEAR_MM

    def texts(self) -> dict[str, str]:
        """Return caption and text of every gauge, in order."""
        return {
            "Frame rate": _figure(self.fps, "{:.0f} fps"),
            "Pose age": _figure(self.pose_age_ms, "{:.0f} ms"),
            "Clearance": self._clearance(),
            "Hazard": self._hazard(),
            "Nostril": self._nostril(),
            "Time": _clock(self.time_s),
            "Registration": _figure(self.registration_mm, "{:.2f} mm"),
        }

    def status(self, *, is_recording: bool, picture: str = "") -> str:
        """Return a quiet line on how well all goes.

        picture: what to say of the picture's size.
        """
        words = [
            _figure(self.fps, "{:.0f} fps"),
            f"pose {_figure(self.pose_age_ms, '{:.0f} ms')}",
            f"registration {_figure(self.registration_mm, '{:.2f} mm')}",
            picture,
            "recording" if is_recording else "not recording",
        ]
        return " · ".join(word for word in words if word)

    def _nostril(self) -> str:
        """Return the force on the nostril, of scope and of tool, by a guess."""
        if not self.drags_mm:
            return UNKNOWN
        forces = [STIFFNESS_N_MM * mm for mm in self.drags_mm.values()]
        return " + ".join(f"{newtons:.1f}" for newtons in forces) + " N"

    def _hazard(self) -> str:
        if not self.has_hazards:
            return NO_LABELS
        if self.hazard is None:
            return UNKNOWN
        name, distance_mm = self.hazard
        if distance_mm > HAZARD_FAR_MM:
            return "far"
        return f"{name} {distance_mm:.1f} mm"

    def _clearance(self) -> str:
        if self.clearance_mm is None:
            return UNKNOWN
        if self.clearance_mm > FREE_MM:
            return "free"
        if self.is_contact:
            return f"contact {-self.clearance_mm:.1f} mm"
        return f"{self.clearance_mm:.1f} mm"


def _figure(value: float | None, form: str) -> str:
    return UNKNOWN if value is None else form.format(value)


def _clock(time_s: float | None) -> str:
    if time_s is None:
        return UNKNOWN
    minutes, seconds = divmod(math.floor(time_s * 10) / 10, 60.0)
    return f"{minutes:.0f}:{seconds:04.1f}"


def injury_text(injury: "Injury") -> str:
    """Return what was hurt, on which side and through which wall."""
    where = injury.structure
    if injury.side and not where.endswith(injury.side):
        where += f", {injury.side}"
    through = f"through the {injury.wall}" if injury.wall else "no bone there"
    return f"{where}: {through}, by the {injury.by}"


JAW_CLOSED, JAW_OPEN = 0.9, 0.1
"""A jaw beyond these is called closed, or open."""


def tool_text(state: InstrumentState) -> str:
    """Return which tool is in hand and what it does."""
    if state.name == NO_TOOL:
        return "no tool"
    tool, words = instrument_named(state.name), [state.name]
    if tool.has_jaws:
        ends = "half open" if state.jaw > JAW_OPEN else "open"
        words.append(f"jaws {'closed' if state.jaw >= JAW_CLOSED else ends}")
    elif state.is_working:
        words.append("working")
    if tool.suction_ml_s > 0.0:
        words.append("suction on" if state.is_sucking else "suction off")
    return " · ".join(words)
