"""What an exercise is about, what one learns, what one reached, and its start."""

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import (
    QFrame,
    QPushButton,
    QScrollArea,
    QVBoxLayout,
    QWidget,
)

from app.window.home.exercise_list import ListEntry
from app.window.plain_label import PlainLabel
from app.window.scaling import lay
from app.window.texts import later, tr
from paravol.trainee.cases import KnownCase
from paravol.trainee.exercises import Exercise, attempt_text, learns
from scenarios.ladder import LAST_RUNS, ExerciseStatus

HOW_PASSED = later("Three passes in a row, or five of six, pass it.")


class ExerciseCard(QFrame):
    """Tell of one line of the list; its button starts it."""

    started = Signal()
    scan_wanted = Signal()
    """The head's scan shall be shown whole."""

    def __init__(self) -> None:
        super().__init__()
        self.setObjectName("card")
        self.names_patients = True
        """Each attempt has another patient: nobody has chosen one for all."""
        self._labels = [PlainLabel() for _ in range(6)]
        title, facts, about, learnt, waits, results = self._labels
        title.setObjectName("heading")
        about.setObjectName("body")
        waits.setObjectName("alarm")
        texts = QWidget()
        texts.setObjectName("scrolled")
        rows = lay(QVBoxLayout(texts), 0, gap=10)
        for label in (title, facts, about, waits, learnt, results):
            label.setWordWrap(True)
            rows.addWidget(label)
        rows.addStretch(1)
        scrolled = QScrollArea()
        scrolled.setWidget(texts)
        scrolled.setWidgetResizable(True)
        scrolled.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        scrolled.viewport().setAutoFillBackground(False)
        self.start = QPushButton(tr("Start"))
        self.start.setObjectName("primary")
        self.start.clicked.connect(self.started)
        column = lay(QVBoxLayout(self), 14)
        column.addWidget(scrolled, 1)
        self.scan = QPushButton(tr("Look at the scan"))
        self.scan.clicked.connect(self.scan_wanted)
        column.addWidget(self.scan)
        column.addWidget(self.start)

    def show_entry(self, entry: ListEntry) -> None:
        """Tell of a line."""
        self.scan.setVisible(entry.has_scan)
        if entry.exercise is not None:
            self._show_exercise(entry.exercise)
        elif entry.case is not None:
            self._show_case(entry.case)
        else:
            self._fill(
                tr("Open a case"),
                "",
                tr(
                    "A folder that paravol import made of a CT scan, or paravol "
                    "phantom of a synthetic head."
                ),
            )
            self._offer(tr("Choose a folder…"))

    def _show_exercise(self, exercise: Exercise) -> None:
        scenario = exercise.scenario
        tasks = len(scenario.tasks)
        facts = tr(
            "{level} · {angle_deg:g}° scope",
            level=tr(scenario.level),
            angle_deg=scenario.scope.angle_deg,
        )
        if tasks:
            facts += (
                tr(" · 1 task") if tasks == 1 else tr(" · {tasks} tasks", tasks=tasks)
            )
        if self.names_patients and len(scenario.head.patients) > 1:
            patient = scenario.head.of_attempt(len(exercise.attempts) + 1).number
            facts += tr(" · patient {number}, then another", number=patient)
        waits = ""
        if exercise.door is ExerciseStatus.LOCKED:
            waits = tr(
                "Locked: first pass {exercises}.",
                exercises=_listed([*map(tr, exercise.waits)]),
            )
        learnt = tr("You learn to\n") + "\n".join(
            "•  " + tr(w) for w in learns(scenario)
        )
        about = tr(scenario.about or "A guided flight; nothing must be done.")
        self._fill(
            tr(scenario.title), facts, about, learnt, waits, _results_text(exercise)
        )
        self._offer(tr("Start") if not waits else tr("Locked"), is_open=not waits)

    def _show_case(self, case: KnownCase) -> None:
        self._fill(case.title, tr(case.about), tr("A free flight through this head."))
        where = str(case.folder)
        self._labels[5].setText(where)
        self._labels[5].setVisible(True)
        self._offer(tr("Start"))

    def _fill(self, *texts: str) -> None:
        for label, text in zip(
            self._labels, [*texts, *[""] * len(self._labels)], strict=False
        ):
            label.setText(text)
            label.setVisible(bool(text))

    def _offer(self, text: str, *, is_open: bool = True) -> None:
        self.start.setText(text)
        self.start.setEnabled(is_open)


def _results_text(exercise: Exercise) -> str:
    """Return the last attempts, the newest first, and what passes the exercise."""
    lines = []
    for attempt in reversed(exercise.attempts[-LAST_RUNS:]):
        how = tr(
            "{points}  in {duration_s:.0f} s",
            points=tr(attempt_text(attempt, exercise.scenario)),
            duration_s=attempt.duration_s,
        )
        lines.append(f"{attempt.begun[:10]}   {how}")
    if not lines:
        lines = [tr("Not flown yet.")]
    if exercise.rung is not None and exercise.door is not ExerciseStatus.PASSED:
        lines.append(tr(HOW_PASSED))
    return tr("Your results (✓ points, or ✗ tasks done)\n") + "\n".join(lines)


def _listed(names: list[str]) -> str:
    return (
        tr(" and ").join([", ".join(names[:-1]), names[-1]]) if names[1:] else names[0]
    )
