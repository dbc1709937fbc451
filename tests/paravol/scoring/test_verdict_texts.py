"""One verdict in words: what was not done comes first, and nothing contradicts it."""

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from paravol.scoring.verdict_texts import points_text, verdict_text, whole_text
from scenarios.passing import DoneShare
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
    flown_percent=64.0,
)
MISSED = ExerciseMark(Verdict.NOT_PASSED, ("choana: open",), ("valve: done",))


def test_what_was_not_done_comes_before_the_points_for_what_was() -> None:
    eighth = msgspec.structs.replace(
        REACHED,
        exercise=MISSED,
        verdict=MISSED.verdict,
        done=DoneShare(1, 8, 0.125),
        percent=10.9,
        percent_sigma=0.0,
        flown_percent=87.2,
    )
    assert whole_text(eighth) == (
        "endoscopy: Not passed: 1 of 8 done; choana: open. "
        "10.9 of 100 points: 87.2 for how it was flown, 12.5 % was done."
    )


def test_a_rubrics_own_mark_is_told_where_nothing_else_is_asked_for() -> None:
    assert whole_text(REACHED) == (
        "endoscopy: Passed: 60 points are needed. "
        "64.0 ± 0.4 of 100 points for how it was flown."
    )


@given(st.sampled_from(Verdict), st.floats(0.0, 100.0), st.integers(0, 8))
def test_no_mark_of_the_rubric_stands_beside_that_of_the_exercise(
    verdict: Verdict, percent: float, done: int
) -> None:
    found = msgspec.structs.replace(
        REACHED,
        exercise=ExerciseMark(verdict),
        verdict=verdict,
        percent=percent,
        done=DoneShare(done, 8, done / 8.0),
    )
    told = whole_text(found)
    assert "needed" not in told
    assert ("Passed" in told) == (verdict is Verdict.PASSED)
    assert (f"{done} of 8 done" in told) == (done < 8)


@pytest.mark.parametrize("verdict", list(Verdict))
def test_no_two_verdicts_read_alike(verdict: Verdict) -> None:
    mine = verdict_text(msgspec.structs.replace(REACHED, verdict=verdict))
    told = {
        verdict_text(msgspec.structs.replace(REACHED, verdict=other))
        for other in set(Verdict) - {verdict}
    }
    assert mine not in told


def test_what_could_not_be_scored_says_why() -> None:
    found = msgspec.structs.replace(
        REACHED, percent=None, verdict=Verdict.NO_DATA, remarks=("Too short.",)
    )
    assert points_text(found) == "No points: Too short."
    assert verdict_text(found) == "Whether it is passed is not known"
