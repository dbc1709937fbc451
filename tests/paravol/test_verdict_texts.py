"""A rubric and an exercise's own mark are told apart in words."""

import msgspec
import pytest

from paravol.verdict_texts import rubric_text, whole_exercise_text, whole_text
from scenarios.rubrics import Assessment, ExerciseMark, Verdict

REACHED = Assessment(
    session="a.paravol",
    rubric="endoscopy",
    rubric_version=1,
    rubric_title="Diagnostic endoscopy",
    rubric_sha256="",
    parts=(),
    fails=(),
    points=64.0,
    counted_points=100.0,
    most_points=100.0,
    percent=64.0,
    percent_sigma=0.4,
    pass_percent=60.0,
    verdict=Verdict.PASSED,
)
MISSED = ExerciseMark(Verdict.NOT_PASSED, ("choana: open",), ("valve: done",))


def test_each_names_its_own_mark() -> None:
    both = msgspec.structs.replace(REACHED, exercise=MISSED)
    assert whole_text(both) == (
        "endoscopy: 64.0 ± 0.4 %, 60 % needed: reached. "
        "The exercise's own mark was not met: choana: open."
    )
    assert whole_text(REACHED) == "endoscopy: 64.0 ± 0.4 %, 60 % needed: reached."


@pytest.mark.parametrize("verdict", list(Verdict))
def test_no_two_verdicts_read_alike(verdict: Verdict) -> None:
    mark = ExerciseMark(verdict)
    others = [ExerciseMark(other) for other in Verdict if other is not verdict]
    assert whole_exercise_text(mark) not in map(whole_exercise_text, others)
    if verdict is not Verdict.NO_DATA:
        mine = rubric_text(msgspec.structs.replace(REACHED, verdict=verdict))
        told = {
            rubric_text(msgspec.structs.replace(REACHED, verdict=other))
            for other in set(Verdict) - {verdict, Verdict.NO_DATA}
        }
        assert mine not in told


def test_what_could_not_be_scored_says_why() -> None:
    found = msgspec.structs.replace(
        REACHED, percent=None, verdict=Verdict.NO_DATA, remarks=("Too short.",)
    )
    assert rubric_text(found) == "not enough data: Too short."
