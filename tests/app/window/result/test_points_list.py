"""What the page says after flights as people fly them: nothing in it contradicts."""

import re
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import pytest
from PySide6.QtWidgets import QApplication

from app.window.result.result_page import ResultPage
from paravol.scoring.metric_texts import metric_figure
from paravol.scoring.verdict_texts import whole_text
from scenarios.rubrics import Verdict
from tests.app.window.desk_run import delete
from tests.app.window.result.flown_ends import (
    FlownEnd,
    only_first,
    scripted,
    shaving,
    told,
)

EXPONENT = re.compile(r"\d[eE][-+]?\d")


@pytest.fixture
def pages(application: QApplication) -> Iterator[list[ResultPage]]:
    shown: list[ResultPage] = []
    yield shown
    for page in shown:
        page.release()
        page.close()
        delete(page)


def one_word_has_one_number(flown: FlownEnd, lines: list[str]) -> None:
    """Each metric's name stands beside its own figure, wherever it is told."""
    assert not [line for line in lines if EXPONENT.search(line)]
    assert not [line for line in lines if "gauge" in line]
    for metric in flown.result.metrics:
        for name, text in pairwise(lines):
            if name == metric.name and metric.role == "scope" and "✓" not in text:
                assert text == metric_figure(metric)


def test_a_scope_held_still_is_not_judged(
    pages: list[ResultPage], tmp_path: Path
) -> None:
    still = scripted("hoops", lambda hand: hand.stay(5.8))
    flown = FlownEnd(tmp_path / "still.paravol", *still)
    pages.append(flown.page())
    lines = told(pages[0])
    assert pages[0].verdict.text() == "Not passed yet"
    assert pages[0].points.text() == "0 of 1 tasks"
    assert pages[0].handling.text() == "no points"
    why = [line for line in lines if "Too little was flown to be judged" in line]
    assert len(why) == 1
    assert not [line for line in lines if re.match(r"[1-9.]+ of \d+$", line)]
    one_word_has_one_number(flown, lines)


def test_one_task_of_eight_is_told_as_that(
    pages: list[ResultPage], tmp_path: Path
) -> None:
    flown = FlownEnd(tmp_path / "eighth.paravol", *scripted("centring", only_first))
    pages.append(flown.page())
    lines, found = told(pages[0]), flown.result.assessment
    assert pages[0].verdict.text() == "Not passed yet"
    assert pages[0].points.text() == "1 of 8 tasks"
    assert found.percent is not None
    assert found.percent <= 12.5
    assert pages[0].handling.text() == f"{round(found.percent, 1):g} of 100 points"
    times = dict(pairwise(lines))
    assert times["Time"] == "0.0 of 10"
    assert found.verdict is Verdict.NOT_PASSED
    assert whole_text(found).startswith("endoscopy: Not passed: 1 of 8 done; ")
    one_word_has_one_number(flown, lines)


def test_all_done_has_its_points_whole(pages: list[ResultPage], tmp_path: Path) -> None:
    flown = FlownEnd(
        tmp_path / "all.paravol", *scripted("hoops", lambda hand: hand.do_all())
    )
    pages.append(flown.page())
    found = flown.result.assessment
    assert pages[0].points.text() == "1 of 1 tasks"
    assert found.percent == found.flown_percent
    assert not any(part.withheld for part in found.parts)
    assert (pages[0].verdict.text() == "Passed") == (found.verdict is Verdict.PASSED)
    one_word_has_one_number(flown, told(pages[0]))


def test_an_injury_takes_the_points_for_keeping_away(
    pages: list[ResultPage], tmp_path: Path
) -> None:
    """A dose of 0 s had 20.0 of 20 points after an injury of 2.8 mm."""
    flown = FlownEnd(tmp_path / "hurt.paravol", *shaving(hurts=True))
    pages.append(flown.page())
    lines, found = told(pages[0]), flown.result.assessment
    assert found.rubric == "operation"
    near = [part for part in found.parts if part.source == "hazard dose"]
    assert [part.points for part in near] == [0.0, 0.0]
    assert any("No points: orbit was hurt" in line for line in lines)
    assert "✗ failed: orbit was hurt" in lines
    # all was done, and yet it is neither passed nor worth much
    assert pages[0].points.text() == "1 of 1 tasks"
    assert pages[0].verdict.text() == "Not passed yet"
    assert found.percent is not None
    assert found.percent <= 40.0
    # what was hurt is the first of the figures
    assert lines[lines.index("Figures") + 1] == "injury: orbit"
    one_word_has_one_number(flown, lines)
