"""What a trainee is asked to do, as a scenario file says it.

Each kind is one table ``[[tasks]]`` with its ``kind``. Places are names of landmarks of
the head, or patient LPS in mm. Times are of the score's clock, which stands while the
trainer is frozen.
"""

from enum import StrEnum

import msgspec

Point = tuple[float, float, float]
Place = str | Point


class Held(StrEnum):
    """Name the tool whose tip a task is about."""

    SCOPE = "scope"
    TOOL = "tool"


class TaskBase(
    msgspec.Struct,
    frozen=True,
    forbid_unknown_fields=True,
    kw_only=True,
    tag_field="kind",
):
    """What every kind of task has.

    name: of the task, for `after`, events and rubrics; once in a scenario. title: what
    the trainee reads. hint: shown when it is asked for. after: names of tasks that must
    be done first. is_optional: an exercise is complete without it.
    """

    name: str
    title: str
    hint: str = ""
    after: tuple[str, ...] = ()
    is_optional: bool = False


class Reach(TaskBase, frozen=True, tag="reach"):
    """Bring a tip to a place: within radius_mm of it for hold_s at a stretch."""

    place: Place
    radius_mm: float
    held: Held = Held.SCOPE
    hold_s: float = 0.0


class LookTask(TaskBase, frozen=True, tag="look"):
    """Look at a place, with nothing in between, for hold_s at a stretch.

    within_deg: from the middle of the picture, at most. nearest_mm, farthest_mm: from
    the lens. level_deg: the picture is turned from upright by so much at most.
    """

    place: Place
    within_deg: float = 15.0
    nearest_mm: float = 2.0
    farthest_mm: float = 30.0
    hold_s: float = 1.0
    level_deg: float = 180.0


class Hold(TaskBase, frozen=True, tag="hold"):
    """Hold a tip still near a place for hold_s at a stretch.

    radius_mm: from the place, at most. still_mm: from where the hold began, at most.
    """

    place: Place
    radius_mm: float
    still_mm: float
    hold_s: float
    held: Held = Held.SCOPE


class Ring(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Place a hoop: its middle, the direction it is passed in, its radius."""

    place: Place
    axis: Point
    radius_mm: float


class Follow(TaskBase, frozen=True, tag="follow"):
    """Pass a tip through rings, in their order and along their axes."""

    rings: tuple[Ring, ...]
    held: Held = Held.SCOPE


class Inject(TaskBase, frozen=True, tag="inject"):
    """Put a tool's tip into tissue at a place and work its pedal for hold_s.

    tool: its name in the catalogue. radius_mm: from the place, at most. deepest_mm:
    below the surface, at most.
    """

    place: Place
    tool: str
    radius_mm: float = 2.0
    deepest_mm: float = 3.0
    hold_s: float = 1.0


class Limits(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Bound a volume that is taken, mm3; most_mm3: None for no bound."""

    least_mm3: float = 0.0
    most_mm3: float | None = None


class Share(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Bound the share of a part that is taken, percent of what it was at first."""

    least_percent: float = 0.0
    most_percent: float = 100.0


class Remove(TaskBase, frozen=True, tag="remove"):
    """Take tissue within limits: by tissue, by the bone of walls, and by part.

    Tissues and walls are those of the books, see `surgery.patient.VolumeLedger`, of the
    whole head; parts are named places of one side, see `scenarios.tasks.head_parts`.
    Too much fails at once. A task that asks for nothing only spares: it is done at the
    end.
    """

    tissues: dict[str, Limits] = {}
    walls: dict[str, Limits] = {}
    parts: dict[str, Share] = {}

    @property
    def asks(self) -> bool:
        """Return whether anything is to be taken."""
        volumes = (*self.tissues.values(), *self.walls.values())
        return any(limit.least_mm3 > 0.0 for limit in volumes) or any(
            share.least_percent > 0.0 for share in self.parts.values()
        )


class Open(TaskBase, frozen=True, tag="open"):
    """Widen the neck between two rooms until a ball of radius_mm passes.

    start, end: the middle of the neck, or before it, and well inside the room behind;
    no tissue lies between them. area_mm2: of the neck, at least.
    """

    start: Place
    end: Place
    radius_mm: float
    area_mm2: float = 0.0


class KeepAway(TaskBase, frozen=True, tag="keep away"):
    """Keep scope and tool away from hazards until the end.

    margin_mm: nearer than this counts, the more the nearer: a tool at the hazard for
    one second is a dose of one. most_dose_s: of each hazard. An injury fails at once.
    """

    hazards: tuple[str, ...]
    margin_mm: float
    most_dose_s: float


class Survey(TaskBase, frozen=True, tag="survey"):
    """See so much of the mucosa of sites: percent of each, by name."""

    sites: dict[str, float]


Task = Reach | LookTask | Hold | Follow | Inject | Remove | Open | KeepAway | Survey
