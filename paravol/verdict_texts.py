"""What a session reached, in words: by a rubric, and by its exercise's own mark.

They are two answers to two questions, so that each names its own mark.
"""

from scenarios.metrics.value_text import value_text
from scenarios.rubrics import Assessment, ExerciseMark, Verdict

_OF_RUBRIC = {
    Verdict.PASSED: "reached",
    Verdict.NOT_PASSED: "not reached",
    Verdict.UNDECIDED: "too near to it to tell",
}
_OF_EXERCISE = {
    Verdict.PASSED: "The exercise's own mark was met",
    Verdict.NOT_PASSED: "The exercise's own mark was not met",
    Verdict.UNDECIDED: "Whether the exercise's own mark was met is too near to tell",
    Verdict.NO_DATA: "Whether the exercise's own mark was met is not known",
}


def rubric_text(assessment: Assessment) -> str:
    """Return the total with its noise, and how it stands to the rubric's mark."""
    if assessment.percent is None:
        return f"{assessment.verdict}: {assessment.remarks[-1]}"
    percent = value_text(assessment.percent, assessment.percent_sigma, "%")
    text = f"{percent}, {assessment.pass_percent:g} % needed: "
    text += _OF_RUBRIC[assessment.verdict]
    if assessment.fails:
        text += f" ({'; '.join(fail.name for fail in assessment.fails)})"
    return text


def exercise_text(mark: ExerciseMark) -> str:
    """Return how the exercise's own mark stands."""
    return _OF_EXERCISE[mark.verdict]


def whole_exercise_text(mark: ExerciseMark) -> str:
    """Return how the exercise's own mark stands, and why, in one line."""
    whys = "; ".join(mark.missed or mark.kept)
    return f"{exercise_text(mark)}: {whys}" if whys else exercise_text(mark)


def whole_text(assessment: Assessment) -> str:
    """Return in one line what the rubric and the exercise's own mark say."""
    text = f"{assessment.rubric}: {rubric_text(assessment)}."
    mark = assessment.exercise
    if mark is None:
        return text
    told = whole_exercise_text(mark) if mark.missed else exercise_text(mark)
    return f"{text} {told}."
