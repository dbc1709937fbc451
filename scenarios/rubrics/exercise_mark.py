"""Whether an exercise was passed: by its marks, and the percent that it asks for."""

from collections.abc import Sequence

from scenarios.metrics.metric import Metric
from scenarios.passing import PassMark, pass_marks
from scenarios.rubrics.assessment import ExerciseMark, Verdict
from scenarios.scenario import Scenario
from scenarios.tasks import TaskState


def exercise_mark(
    scenario: Scenario,
    tasks: Sequence[TaskState],
    metrics: Sequence[Metric],
    percent: float | None,
) -> ExerciseMark | None:
    """Judge a session by what its own exercise asks for; None where that is nothing.

    tasks: their states; none where the session did not get to its end. percent: of a
    rubric's points. One mark that was not met is enough not to pass; where none was
    missed but one is not known, there is no verdict.
    """
    states = {state.name: str(state.status) for state in tasks}
    reasons = {state.name: state.why for state in tasks}
    marks = [
        mark if not reasons.get(mark.title) else _because(mark, reasons[mark.title])
        for mark in pass_marks(scenario, states, metrics)
    ]
    least = scenario.marks.least_percent
    if least > 0.0:
        is_met = None if percent is None else percent >= least
        got = "not scored" if percent is None else f"{percent:.1f} %"
        marks.append(PassMark("points", is_met, f"{got}, {least:g} % are asked for"))
    if not marks:
        return None
    met = [mark.is_met for mark in marks]
    verdict = Verdict.PASSED
    if False in met:
        verdict = Verdict.NOT_PASSED
    elif None in met:
        verdict = Verdict.NO_DATA
    missed = tuple(_told(mark) for mark in marks if not mark.is_met)
    return ExerciseMark(verdict, missed, tuple(_told(m) for m in marks if m.is_met))


def _because(mark: PassMark, why: str) -> PassMark:
    return PassMark(mark.title, mark.is_met, f"{mark.why}, {why}")


def _told(mark: PassMark) -> str:
    return f"{mark.title}: {mark.why or 'not known'}"
