"""The result page: passed or not, points and reasons, what to practise, where next."""

from dataclasses import dataclass
from pathlib import Path

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import (
    QFrame,
    QGridLayout,
    QHBoxLayout,
    QPushButton,
    QScrollArea,
    QVBoxLayout,
    QWidget,
)

from app.window.keyboard.places import american
from app.window.page import TextPage
from app.window.plain_label import paragraph
from app.window.result.debrief_row import DebriefRow
from app.window.result.points_list import PointsList
from app.window.scaling import lay
from app.window.texts import tr
from paravol.flight.flight_events import FlightEnd
from paravol.scoring.score_table import score_rows
from paravol.scoring.verdict_texts import total_text
from paravol.trainee.exercises import Exercise, short_title
from paravol.trainee.record import TraineeRecord
from paravol.trainee.session_result import SessionResult
from scenarios import Scenario
from scenarios.ladder import ExerciseStatus
from scenarios.passing import goals_of
from scenarios.tasks import Status


@dataclass(frozen=True, slots=True)
class WhatNext:
    """What follows: the same exercise as it stands now, the next one, None."""

    same: Exercise | None = None
    following: Exercise | None = None


def what_next(record: TraineeRecord, name: str) -> WhatNext:
    """Return how an exercise stands now, and which other one is worth doing next."""
    ladder = record.ladder
    following: Exercise | None = ladder.worth_doing(name)
    if following is not None and following.name == name:
        found = (
            e
            for e in ladder.exercises
            if e.door is ExerciseStatus.OPEN and e.name != name
        )
        following = next(found, None)
    return WhatNext(ladder.find(name), following)


class ResultPage(TextPage):
    """Show a flight's figures at once, and its score when that is there."""

    again_wanted = Signal()
    next_wanted = Signal(str)
    home_wanted = Signal()
    replay_wanted = Signal(Path)
    debrief_wanted = Signal(Path)

    def __init__(self, scenario: Scenario, end: FlightEnd, problem: str = "") -> None:
        """Show how a flight ended; problem: what went wrong in it."""
        super().__init__()
        self.title = f"PARAVOL: {tr(scenario.title)}"
        self._end = end
        self._following = ""
        self.verdict = paragraph(tr(end.title), "verdict")
        self._about = paragraph(tr(scenario.title), "heading")
        self.standing = paragraph("")
        self.points = paragraph(_tasks_text(scenario, end), "verdict")
        self.handling = paragraph("")
        self.say(problem)
        self.written = DebriefRow()
        self.parts = PointsList()
        self.parts.hide()
        self._advice = _Card(tr("What to practise next"))
        self._advice.hide()
        self._tasks = _Card(tr("What was asked"))
        self._figures = _Card(tr("Figures"))
        self._kept = paragraph("")
        self._fill_figures(scenario, end)
        self.debrief = QPushButton(tr("Debrief (D)"))
        self.replay = QPushButton(tr("Replay (R)"))
        self.again = QPushButton(tr("Again (A)"))
        self.following = QPushButton(tr("Next (N)"))
        self.home = QPushButton(tr("Home (H)"))
        self._lay_out()
        self.following.hide()
        has_record = end.record is not None
        self.debrief.setEnabled(has_record)
        self.replay.setEnabled(has_record)
        self.show_stage(tr("Scoring") if has_record else "")
        for button, does in (
            (self.debrief, self._debrief),
            (self.replay, self._replay),
            (self.again, self.again_wanted.emit),
            (self.following, self._next),
            (self.home, self.home_wanted.emit),
        ):
            button.clicked.connect(lambda _=False, does=does: does())

    def _lay_out(self) -> None:
        head = QHBoxLayout()
        words = QVBoxLayout()
        words.addWidget(self.verdict)
        words.addWidget(self._about)
        words.addWidget(self.standing)
        head.addLayout(words, 1)
        self.points.setAlignment(Qt.AlignmentFlag.AlignRight)
        self.handling.setAlignment(Qt.AlignmentFlag.AlignRight)
        for label in (self.points, self.handling):
            label.setWordWrap(False)
        right = QVBoxLayout()
        right.addWidget(self.points)
        right.addWidget(self.handling)
        right.addStretch(1)
        head.addLayout(right)
        state = QHBoxLayout()
        state.addWidget(self.stage)
        state.addWidget(self.share, 1)
        self._left = _column(self._advice, self.parts)
        self._right = _column(self._tasks, self._figures, self._kept)
        middle, buttons = lay(QHBoxLayout(), gap=10), lay(QHBoxLayout(), gap=10)
        middle.addWidget(_scrolled(self._left), 3)
        middle.addWidget(_scrolled(self._right), 2)
        buttons.addWidget(self.debrief)
        buttons.addWidget(self.replay)
        buttons.addStretch(1)
        for button in (self.home, self.again, self.following):
            buttons.addWidget(button)
        rows = lay(QVBoxLayout(self), 16, gap=10)
        rows.addLayout(head)
        rows.addWidget(self.problem)
        rows.addWidget(self.written)
        rows.addLayout(state)
        rows.addLayout(middle, 1)
        rows.addLayout(buttons)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Press the button of a key."""
        ctrl = bool(event.modifiers() & Qt.KeyboardModifier.ControlModifier)
        match american(event):
            case Qt.Key.Key_Q if ctrl:
                self.left.emit()
            case Qt.Key.Key_F11:
                self.full_screen_wanted.emit()
            case Qt.Key.Key_D:
                self.debrief.click()
            case Qt.Key.Key_R:
                self.replay.click()
            case Qt.Key.Key_A:
                self.again.click()
            case Qt.Key.Key_N if self.following.isVisible():
                self.following.click()
            case Qt.Key.Key_H | Qt.Key.Key_Escape:
                self.home.click()
            case _:
                super().keyPressEvent(event)

    def showEvent(self, event: object) -> None:
        """Let Enter fly on."""
        self._prefer(self.again)

    def show_result(self, result: SessionResult) -> None:
        """Show the points with their reasons, and what to practise."""
        self.show_stage("")
        assessment = result.assessment
        verdict = {True: tr("Passed"), False: tr("Not passed yet")}
        if result.has_passed is not None:
            self.verdict.setText(verdict[result.has_passed])
            self.verdict.setProperty("passed", str(result.has_passed).lower())
            self.verdict.style().polish(self.verdict)
        points = self.handling if self.points.text() else self.points
        points.setText(tr(total_text(assessment)))
        self.parts.show_assessment(assessment)
        self.parts.show()
        for advice in result.advice:
            self._advice.add(tr(advice.title), f"{tr(advice.why)} {tr(advice.how)}")
        self._advice.show()
        self._show_figures(score_rows(self._end.score, result.metrics))
        names = {state.name for state in self._end.score.tasks}
        signs = {True: "✓", False: "✗", None: tr("not known")}
        for mark in result.marks:
            if mark.title not in names:
                self._tasks.add_row(
                    tr(mark.title), f"{signs[mark.is_met]} {tr(mark.why)}"
                )
                self._tasks.show()
        self._kept.setText(f"{self._kept.text()}\n{tr(result.kept)}".strip())

    def show_next(self, after: WhatNext) -> None:
        """Say how the exercise stands now, and offer what follows."""
        same, following = after.same, after.following
        if same is not None and same.rung is not None:
            if same.door is ExerciseStatus.PASSED:
                text = tr("This exercise is passed.")
            else:
                runs = same.rung.runs
                counted = (
                    tr("the last {runs} runs", runs=runs) if runs != 1 else tr("1 run")
                )
                text = tr(
                    "{passes} of {counted} passed; ",
                    passes=same.rung.passes,
                    counted=counted,
                )
                text += tr("three in a row, or five of six, pass the exercise.")
            self.standing.setText(text)
        if following is None:
            return
        self._following = following.name
        self.following.setText(
            tr("Next: {exercise} (N)", exercise=tr(short_title(following.scenario)))
        )
        self.following.show()
        if same is not None and same.door is ExerciseStatus.PASSED:
            self._prefer(self.following)

    def _prefer(self, button: QPushButton) -> None:
        """Make a button the one that Enter presses."""
        for each in (self.again, self.following):
            each.setObjectName("primary" if each is button else "")
            each.style().polish(each)
        button.setFocus()

    def _fill_figures(self, scenario: Scenario, end: FlightEnd) -> None:
        titles = {task.name: task.title for task in scenario.tasks}
        words = {Status.DONE: tr("✓ done"), Status.FAILED: tr("✗ failed")}
        goals = goals_of(scenario)
        for state in end.score.tasks:
            told = words.get(
                state.status, tr("not done, {progress:.0%}", progress=state.progress)
            )
            if state.status is Status.DONE and state.name not in goals:
                told = tr("✓ kept")
            if state.why:
                told += f": {tr(state.why)}"
            self._tasks.add_row(tr(titles.get(state.name, state.name)), told)
        self._tasks.setVisible(bool(end.score.tasks))
        self._show_figures(end.rows())
        self._kept.setText(tr(end.where()))

    def _show_figures(self, rows: list[tuple[str, str]]) -> None:
        """Show these alone, what was hurt first."""
        self._figures.clear()
        hurt = [row for row in rows if row[0].startswith(("injury", "broken"))]
        for row in [*hurt, *(row for row in rows if row not in hurt)]:
            self._figures.add_row(*map(tr, row), is_alarm=row in hurt)

    def _debrief(self) -> None:
        if self._end.record is not None:
            self.debrief_wanted.emit(self._end.record)

    def _replay(self) -> None:
        if self._end.record is not None:
            self.replay_wanted.emit(self._end.record)

    def _next(self) -> None:
        if self._following:
            self.next_wanted.emit(self._following)


def _tasks_text(scenario: Scenario, end: FlightEnd) -> str:
    """Return how many tasks were done; to keep away from something is no doing."""
    goals = goals_of(scenario)
    states = [state for state in end.score.tasks if state.name in goals]
    done = sum(state.status is Status.DONE for state in states)
    return tr("{done} of {count} tasks", done=done, count=len(states)) if states else ""


class _Card(QFrame):
    """A titled box of texts, or of names and texts side by side."""

    def __init__(self, title: str) -> None:
        super().__init__()
        self.setObjectName("card")
        self._grid = lay(QGridLayout(self), 12, gap=(10, 4))
        self._grid.setColumnStretch(0, 1)
        self._grid.setColumnStretch(1, 1)
        self._grid.addWidget(paragraph(title, "subheading"), 0, 0, 1, 2)

    def clear(self) -> None:
        """Take all but the title out."""
        while self._grid.count() > 1:
            item = self._grid.takeAt(1)
            if item is not None and (label := item.widget()) is not None:
                label.hide()
                label.deleteLater()

    def add(self, title: str, text: str) -> None:
        for label in (paragraph(title, "body"), paragraph(text)):
            self._grid.addWidget(label, self._grid.rowCount(), 0, 1, 2)

    def add_row(self, name: str, text: str, *, is_alarm: bool = False) -> None:
        row = self._grid.rowCount()
        top = Qt.AlignmentFlag.AlignTop
        self._grid.addWidget(paragraph(name), row, 0, top)
        figure = paragraph(text, "alarm" if is_alarm else "figure")
        self._grid.addWidget(figure, row, 1, top)


def _column(*parts: QWidget) -> QWidget:
    column = QWidget()
    column.setObjectName("scrolled")
    rows = lay(QVBoxLayout(column), 0, gap=10)
    for part in parts:
        rows.addWidget(part)
    rows.addStretch(1)
    return column


def _scrolled(content: QWidget) -> QScrollArea:
    area = QScrollArea()
    area.setWidget(content)
    area.setWidgetResizable(True)
    area.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
    area.viewport().setAutoFillBackground(False)
    return area
