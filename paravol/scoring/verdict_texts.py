"""What a session reached, in words: one verdict, and the points for what was done.

Where an exercise has a mark of its own, that decides; a rubric's mark is of flights of
any kind, and is told only where nothing else is asked for.
"""

from scenarios.metrics.value_text import value_text
from scenarios.rubrics import Assessment, Verdict

_VERDICTS = {
    Verdict.PASSED: "Passed",
    Verdict.NOT_PASSED: "Not passed",
    Verdict.UNDECIDED: "Too near to the pass mark to tell",
    Verdict.NO_DATA: "Whether it is passed is not known",
}


def headline_text(assessment: Assessment) -> str:
    """Return whether a session is passed, and how much was not done."""
    told, done = _VERDICTS[assessment.verdict], assessment.done
    if done is None or done.is_all:
        return told
    return f"{told}: {done.done} of {done.asked} done"


def verdict_text(assessment: Assessment) -> str:
    """Return whether a session is passed, what was not done, and what else was not."""
    mark = assessment.exercise
    whys: list[str] = []
    if mark is not None:
        whys += mark.missed
    elif assessment.percent is not None:
        whys.append(f"{assessment.pass_percent:g} points are needed")
        whys += [fail.why for fail in assessment.fails]
    told = headline_text(assessment)
    between = "; " if ":" in told else ": "
    return f"{told}{between}{'; '.join(whys)}" if whys else told


def total_text(assessment: Assessment) -> str:
    """Return the total with its noise."""
    if assessment.percent is None:
        return "no points"
    told = points_figure(assessment.percent, assessment.percent_sigma)
    return f"{told} of 100 points"


def points_figure(points: float, sigma: float = 0.0) -> str:
    """Return points to a tenth, and their noise where that is more."""
    return value_text(points, sigma) if sigma >= 0.05 else value_text(round(points, 1))


def points_text(assessment: Assessment) -> str:
    """Return the total and what it is for, or why there is none."""
    if assessment.percent is None:
        return f"No points: {assessment.remarks[0]}"
    done, flown = assessment.done, assessment.flown_percent
    if done is None or done.is_all or flown is None:
        return f"{total_text(assessment)} for how it was flown"
    share = value_text(round(100.0 * done.share, 1), unit="%")
    told = points_figure(flown)
    return f"{total_text(assessment)}: {told} for how it was flown, {share} was done"


def whole_text(assessment: Assessment) -> str:
    """Return in one line what a session reached."""
    verdict, points = verdict_text(assessment), points_text(assessment)
    return f"{assessment.rubric}: {verdict}. {points.rstrip('.')}."
