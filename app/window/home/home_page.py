"""The home page: the ladder, cases, who trains with what, and what to go on with."""

from collections.abc import Sequence
from pathlib import Path

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import (
    QFileDialog,
    QHBoxLayout,
    QPushButton,
    QVBoxLayout,
)

from app.window.home.exercise_card import ExerciseCard
from app.window.home.exercise_list import ExerciseList, ListEntry
from app.window.home.home_bar import HomeBar
from app.window.home.recovery_card import RecoveryCard
from app.window.keyboard.places import american
from app.window.page import TextPage
from app.window.plain_label import PlainLabel
from app.window.scaling import hold, lay
from app.window.texts import later, tr
from app.window.tour import Tour, TourStop
from paravol.trainee.cases import KnownCase
from paravol.trainee.exercises import Ladder, short_title
from scenarios.ladder import ExerciseStatus

KEYS = later("Enter starts · Tab moves on · F1 tour · F11 full screen · Ctrl+Q ends")


class HomePage(TextPage):
    """Show what can be trained; whoever made it fills it and does what is wanted."""

    exercise_wanted = Signal(str)
    """An exercise, by name, shall be flown."""
    case_wanted = Signal(Path)
    """A case folder shall be flown through."""
    scan_wanted = Signal(object)
    """The scan of an entry of the list, a `ListEntry`, shall be shown whole."""
    recordings_wanted = Signal()
    settings_wanted = Signal()
    tour_ended = Signal()
    given_up = Signal()
    """What is being prepared is not wanted any more."""

    def __init__(self) -> None:
        super().__init__()
        self.title = "PARAVOL"
        self._tour: Tour | None = None
        self._next = ""
        self._ladder: Ladder | None = None
        self._cases: list[KnownCase] = []
        self.bar = HomeBar()
        self.list = ExerciseList()
        self.card = ExerciseCard()
        self.recovery = RecoveryCard()
        self.go_on = QPushButton()
        self.go_on.setObjectName("primary")
        self._lay_out()
        self.show_stage("")
        self.list.selected.connect(self.card.show_entry)
        self.list.chosen.connect(self._fly)
        self.card.started.connect(self._start_selected)
        self.card.scan_wanted.connect(self._show_scan)
        self.go_on.clicked.connect(self._go_on)
        self.bar.recordings.clicked.connect(self.recordings_wanted)
        self.bar.settings.clicked.connect(self.settings_wanted)
        self.bar.tour.clicked.connect(self.start_tour)
        self.bar.refused.connect(self.say)

    def _lay_out(self) -> None:
        middle, left = lay(QHBoxLayout(), gap=10), lay(QVBoxLayout(), gap=10)
        left.addWidget(self.go_on)
        left.addWidget(self.list, 1)
        middle.addLayout(left, 3)
        middle.addWidget(self.card, 2)
        foot = QHBoxLayout()
        foot.addWidget(PlainLabel(tr(KEYS)), 1)
        foot.addWidget(self.stage)
        foot.addWidget(self.share)
        hold(self.share, setFixedWidth=160)
        rows = lay(QVBoxLayout(self), 16, 16, 16, 8, gap=10)
        rows.addWidget(self.bar)
        rows.addWidget(self.problem)
        rows.addWidget(self.recovery)
        rows.addLayout(middle, 1)
        rows.addLayout(foot)

    def set_scale(self, scale: float) -> None:
        """Draw everything as large as the window has room for."""
        super().set_scale(scale)
        if self._ladder is not None:
            # with the colours of another theme
            current = self.list.current
            exercise = None if current is None else current.exercise
            name = self._next if exercise is None else exercise.name
            self.list.show_all(self._ladder, self._cases, name)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Obey a key that no part of the page takes."""
        ctrl = bool(event.modifiers() & Qt.KeyboardModifier.ControlModifier)
        match american(event):
            case Qt.Key.Key_F1:
                self.start_tour()
            case Qt.Key.Key_F11:
                self.full_screen_wanted.emit()
            case Qt.Key.Key_Q if ctrl:
                self.left.emit()
            case Qt.Key.Key_Escape if not self.stage.isHidden():
                self.given_up.emit()
            case _:
                super().keyPressEvent(event)

    def show_ladder(
        self, ladder: Ladder, cases: Sequence[KnownCase], last: str = ""
    ) -> None:
        """Show how the trainee stands; last: name of what was flown last."""
        self._ladder, self._cases = ladder, list(cases)
        following = ladder.worth_doing(last)
        current = self.list.current
        # what somebody chose meanwhile stays chosen
        chosen = None if current is None else current.exercise
        is_own = chosen is not None and chosen.name != self._next
        selected = following.name if chosen is None or not is_own else chosen.name
        self._next = following.name
        word = tr("Continue") if last else tr("Begin")
        if following.door is ExerciseStatus.PASSED:
            word = tr("Fly again")
        self.go_on.setText(f"{word}: {tr(short_title(following.scenario))}")
        self.go_on.setAccessibleName(f"{word}: {tr(following.scenario.title)}")
        self.list.show_all(ladder, list(cases), selected)
        if self.focusWidget() is None or self.focusWidget() is self:
            self.go_on.setFocus()

    def show_stage(self, stage: str, share: float = 0.0) -> None:
        """Say what is being done, and how far it is; nothing starts meanwhile."""
        said = tr("{stage} · Esc gives it up", stage=stage) if stage else ""
        super().show_stage(said, share)
        for part in (self.go_on, self.card, self.list):
            part.setEnabled(not stage)

    def start_tour(self) -> None:
        """Show what there is on this page."""
        if self._tour is not None:
            return
        before = self.focusWidget()
        stops = [
            TourStop(
                None,
                tr("Welcome"),
                tr(
                    "Here you train endoscopic sinus surgery. This takes half a "
                    "minute; F1 shows it again."
                ),
            ),
            TourStop(
                self.go_on,
                tr("Go on here"),
                tr("This starts what is worth doing next. Press Enter and you fly."),
            ),
            TourStop(
                self.list,
                tr("The ladder"),
                tr(
                    "Exercises from the first look to surgery. A locked one "
                    "opens when those before are passed. {passing}",
                    passing=tr(PASSING),
                ),
            ),
            TourStop(
                self.bar.device,
                tr("Your hand"),
                tr(
                    "The mouse always works. An arm, a gamepad or a force device is "
                    "found when it is plugged in."
                ),
            ),
            TourStop(
                self.bar.trainee,
                tr("Who trains"),
                tr(
                    "With a name that you made up, your results are kept apart from "
                    "those of others. None is needed."
                ),
            ),
        ]
        self._tour = Tour(self, stops, self.scale)

        def end() -> None:
            self._tour = None
            (before or self.go_on).setFocus()
            self.tour_ended.emit()

        self._tour.ended.connect(end)

    def _go_on(self) -> None:
        self.list.select(self._next)
        self.exercise_wanted.emit(self._next)

    def _start_selected(self) -> None:
        if self.list.current is not None:
            self._fly(self.list.current)

    def _show_scan(self) -> None:
        if self.list.current is not None:
            self.scan_wanted.emit(self.list.current)

    def _fly(self, entry: ListEntry) -> None:
        if entry.exercise is not None:
            if entry.exercise.door is ExerciseStatus.LOCKED:
                self.say(
                    tr(
                        "{exercise} is locked: first pass {others}.",
                        exercise=tr(short_title(entry.exercise.scenario)),
                        others=", ".join(map(tr, entry.exercise.waits)),
                    )
                )
                return
            self.exercise_wanted.emit(entry.exercise.name)
        elif entry.case is not None:
            self.case_wanted.emit(entry.case.folder)
        else:
            folder = QFileDialog.getExistingDirectory(self, tr("Open a case folder"))
            if folder:
                self.case_wanted.emit(Path(folder))


PASSING = later("Three passes in a row, or five of six, are enough.")
