"""The result page: the figures at once, then the verdict, points and what follows."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QLabel

from app.window.result.points_list import part_points_text, reason_text
from app.window.result.result_page import ResultPage, WhatNext
from paravol.debrief.advice import Advice
from paravol.flight.flight_events import FlightEnd
from paravol.trainee.exercises import ladder_of
from paravol.trainee.session_result import SessionResult
from scenarios import Scenario, load_scenario
from scenarios.passing import PassMark
from scenarios.rubrics import Assessment, HardFail, RubricPart, Standing, Verdict
from scenarios.scoring import Score
from scenarios.tasks import TaskState
from tests.app.window.desk_run import delete
from tests.paravol.progress.learners import entry


def part(name: str, points: float, standing: Standing = Standing.SCORED) -> RubricPart:
    return RubricPart(
        name, name.capitalize(), "task time", "scope", "s", standing, points, 10.0,
        0.0, 31.5, 0.25, None, ((29.0, 100.0), (59.0, 0.0)), (), reason="too short",
    )  # fmt: skip


PARTS = (part("time", 7.5), part("way", 0.0, Standing.NO_DATA))
FAIL = HardFail("hurt", "The orbit was hurt", 30.0, ())


def assessment(percent: float | None = 74.6) -> Assessment:
    verdict = Verdict.NO_DATA if percent is None else Verdict.PASSED
    return Assessment(
        "a", "endoscopy", 1, "Diagnostic", "ab", PARTS, (FAIL,), 7.5, 10.0, 20.0,
        percent, 1.2, 60.0, verdict,
    )  # fmt: skip


def end(*states: TaskState) -> FlightEnd:
    score = Score(12.5, 80.0, 1.5, 0, {}, tasks=list(states))
    return FlightEnd("The flight is over", score, Path("/sessions/a.paravol"), True)


def result(scenario: Scenario, *, has_passed: bool | None) -> SessionResult:
    return SessionResult(
        scenario,
        end().score,
        has_passed,
        (PassMark("contacts", False, "3, at most 1 is allowed"),),
        assessment(),
        (Advice("Steer in the middle", "It touched.", "Fly slowly."),),
        "Kept in your progress.",
        True,
    )


@pytest.fixture
def page(application: QApplication) -> Iterator[ResultPage]:
    scenario, _ = load_scenario("hoops")
    page = ResultPage(scenario, end(TaskState(scenario.tasks[0].name, progress=0.5)))
    page.set_scale(1.0)
    page.resize(1280, 720)
    page.show()
    yield page
    page.release()
    page.close()
    delete(page)


def texts(page: ResultPage) -> str:
    QApplication.processEvents()
    labels = page.findChildren(QLabel)
    return "\n".join(label.text() for label in labels if label.isVisible())


def test_the_figures_are_there_before_the_score(page: ResultPage) -> None:
    told = texts(page)
    for words in ("The flight is over", "0 of 1 tasks", "12.5 s", "not done, 50%"):
        assert words in told
    assert "/sessions/a.paravol" in told
    assert "Where the points come from" not in told
    assert page.focusWidget() is page.again


@pytest.mark.parametrize(
    ("has_passed", "words"),
    [(True, "Passed"), (False, "Not passed yet"), (None, "The flight is over")],
)
def test_verdict_points_reasons_and_advice_are_told(
    page: ResultPage, has_passed: bool | None, words: str
) -> None:
    scenario, _ = load_scenario("hoops")
    page.show_result(result(scenario, has_passed=has_passed))
    assert page.verdict.text() == words
    # what was asked comes first: who does nothing hurts nothing
    assert page.points.text() == "0 of 1 tasks"
    assert page.handling.text() == "74.6 ± 1.2 of 100 points"
    told = texts(page)
    for line in (
        "7.5 of 10",
        "task time: 31.50 ± 0.25 s; full points at 29, none at 59",
        "Not counted: too short",
        "The orbit was hurt: at most 30 points in all.",
        "Steer in the middle",
        "✗ 3, at most 1 is allowed",
        "Kept in your progress.",
    ):
        assert line in told, line


def test_who_passed_is_led_on_and_others_again(page: ResultPage) -> None:
    twice = ladder_of([entry(number=n, has_passed=True) for n in (1, 2)])
    page.show_next(WhatNext(twice.find("hoops"), twice.find("centring")))
    assert "2 of the last 2 runs passed" in page.standing.text()
    assert page.focusWidget() is page.again
    thrice = ladder_of([entry(number=n, has_passed=True) for n in (1, 2, 3)])
    page.show_next(WhatNext(thrice.find("hoops"), thrice.find("centring")))
    assert page.standing.text() == "This exercise is passed."
    assert page.focusWidget() is page.following
    wanted: list[str] = []
    page.next_wanted.connect(wanted.append)
    QTest.keyClick(page.following, Qt.Key.Key_Return)
    QTest.keyClick(page, Qt.Key.Key_N)
    assert wanted == ["centring", "centring"]


def test_keys_press_the_buttons(page: ResultPage) -> None:
    told: list[str] = []
    page.again_wanted.connect(lambda: told.append("again"))
    page.home_wanted.connect(lambda: told.append("home"))
    page.replay_wanted.connect(lambda record: told.append(f"replay {record}"))
    page.debrief_wanted.connect(lambda record: told.append(f"debrief {record}"))
    for key in (Qt.Key.Key_A, Qt.Key.Key_H, Qt.Key.Key_Escape, Qt.Key.Key_R):
        QTest.keyClick(page.again, key)
    page.debrief.setEnabled(False)  # being written
    QTest.keyClick(page, Qt.Key.Key_D)
    assert told == ["again", "home", "home", f"replay {Path('/sessions/a.paravol')}"]


def test_what_was_not_recorded_is_neither_debriefed_nor_replayed(
    application: QApplication,
) -> None:
    scenario, _ = load_scenario("hoops")
    unrecorded = FlightEnd("The path is flown", end().score, None, True, "Disk full.")
    page = ResultPage(scenario, unrecorded, "The arm was lost.")
    assert not page.debrief.isEnabled()
    assert not page.replay.isEnabled()
    assert page.problem.text() == "The arm was lost."


def test_texts_of_parts_name_value_and_bounds() -> None:
    assert part_points_text(PARTS[0]) == "7.5 of 10"
    assert part_points_text(PARTS[1]) == "not counted"
    assert "none at 59" in reason_text(PARTS[0])
