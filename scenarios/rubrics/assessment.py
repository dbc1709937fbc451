"""A session scored by a rubric: every point with the moments that it came from."""

from enum import StrEnum

import msgspec

from scenarios.metrics.metric import Interval
from scenarios.passing import DoneShare

Knots = tuple[tuple[float, float], ...]
"""Values, and the percent of a part's points that each gives; straight in between."""


class Standing(StrEnum):
    """How a part came to its points."""

    SCORED = "scored"
    NO_DATA = "not enough data"
    BELOW_NOISE = "below the noise floor"


class Band(msgspec.Struct, frozen=True):
    """Where a group of the reference population lies: quantiles of a value.

    group: such as "expert". low, middle, high: 10, 50 and 90 %. count: runs with a
    value. source: who these are; generated runs say so.
    """

    group: str
    low: float
    middle: float
    high: float
    count: int
    source: str


class RubricPart(msgspec.Struct, frozen=True):
    """One item of a rubric, scored.

    name, title: the item's. source: the metric, task or figure it reads, by its full
    name. role, unit: of the value. points: got, of most_points; 0 where it does not
    count. points_sigma: 1 sigma of the points, by the value's. value: None where there
    is none; reason says why. sigma: of the value, 1 sigma of the device's noise; None
    where it is unknown. floor: what a tool held still would have given. thresholds:
    values and the percent of the points they give. intervals: seconds of the session
    that the value came from, merged where they overlap. bands: of the reference
    population, for the same value; empty where it was not measured there. is_removal:
    it rewards what was taken. weight: share of its points that counts, below 1 where
    points for removal are held back. why: where the thresholds are from, if the rubric
    says so. withheld: why its points were taken, whatever the value; "" where they were
    not.
    """

    name: str
    title: str
    source: str
    role: str
    unit: str
    standing: Standing
    points: float
    most_points: float
    points_sigma: float
    value: float | None
    sigma: float | None
    floor: float | None
    thresholds: Knots
    intervals: tuple[Interval, ...]
    reason: str = ""
    bands: tuple[Band, ...] = ()
    is_removal: bool = False
    weight: float = 1.0
    why: str = ""
    withheld: str = ""

    @property
    def counts(self) -> bool:
        """Return whether the part is in the total; others are shown in grey."""
        return self.standing is Standing.SCORED


class HardFail(msgspec.Struct, frozen=True):
    """A rule that was broken, and what it left of the total.

    why: in words. most_percent: the total is at most this. intervals: when.
    """

    name: str
    why: str
    most_percent: float
    intervals: tuple[Interval, ...]


class Verdict(StrEnum):
    """Whether the pass mark was reached, as far as noise lets tell."""

    PASSED = "passed"
    NOT_PASSED = "not passed"
    UNDECIDED = "too near to the pass mark to tell"
    NO_DATA = "not enough data"


class ExerciseMark(msgspec.Struct, frozen=True):
    """Whether a session passed its exercise, by the exercise's own pass mark.

    missed: what was not met, or is not known, in words. kept: what was met.
    """

    verdict: Verdict
    missed: tuple[str, ...] = ()
    kept: tuple[str, ...] = ()


class Assessment(msgspec.Struct, frozen=True):
    """A session scored by one version of a rubric.

    session: name of the bundle's folder. rubric, rubric_version, rubric_sha256: which
    rubric. points: of all parts that count, of counted_points; most_points: of the
    whole rubric. flown_percent: 100 points / counted_points, after hard fails: how well
    it was flown; None where too few parts could be scored, or too little was flown.
    done: how much of what the exercise asks for was done; None where it asks for
    nothing. percent: the total, both multiplied. percent_sigma: 1 sigma of it, by the
    device's noise. pass_percent: the rubric's, which decides where the exercise has no
    mark of its own. verdict: the one of both that decides. remarks: what limits the
    score, in sentences. is_complete: the recording has its end. exercise: whether the
    exercise was passed; None where it asks for nothing.
    """

    session: str
    rubric: str
    rubric_version: int
    rubric_title: str
    rubric_sha256: str
    parts: tuple[RubricPart, ...]
    fails: tuple[HardFail, ...]
    points: float
    counted_points: float
    most_points: float
    percent: float | None
    percent_sigma: float
    pass_percent: float
    verdict: Verdict
    is_complete: bool = True
    remarks: tuple[str, ...] = ()
    exercise: ExerciseMark | None = None
    flown_percent: float | None = None
    done: DoneShare | None = None
