"""The list of all that can be flown, with how one stands in each."""

from dataclasses import dataclass

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QColor
from PySide6.QtWidgets import (
    QAbstractItemView,
    QHeaderView,
    QTreeWidget,
    QTreeWidgetItem,
)

from app.window.plain_label import plain_tip
from app.window.style import INK, QUIET, READY
from app.window.texts import later, tr
from paravol.trainee.cases import KnownCase
from paravol.trainee.exercises import Exercise, Ladder, attempt_text
from scenarios.ladder import ExerciseStatus
from scenarios.scenario import Level

COLUMNS = (
    *(later("Exercise"), later("Status"), later("Runs")),
    *(later("Last"), later("Best")),
)
OPEN_CASE = later("Open a case folder…")
_MARKS = {
    ExerciseStatus.PASSED: later("✓ passed"),
    ExerciseStatus.LOCKED: later("locked"),
}
_PLACE = Qt.ItemDataRole.UserRole


@dataclass(frozen=True, slots=True)
class ListEntry:
    """What a line is about: an exercise, a case, or neither, to open a case."""

    exercise: Exercise | None = None
    case: KnownCase | None = None

    @property
    def has_scan(self) -> bool:
        """Return whether there is a head with a CT; an abstract scene has none."""
        if self.exercise is not None:
            return not self.exercise.scenario.head.scene
        return self.case is not None


class ExerciseList(QTreeWidget):
    """List exercises by level, flights and cases; Enter or two clicks choose one."""

    selected = Signal(object)
    """Another line is selected: a `ListEntry`."""
    chosen = Signal(object)
    """A `ListEntry` shall be flown."""

    def __init__(self) -> None:
        super().__init__()
        self._entries: list[ListEntry] = []
        self.setColumnCount(len(COLUMNS))
        self.setHeaderLabels([tr(column) for column in COLUMNS])
        self.setAccessibleName(tr("Exercises and cases"))
        self.setRootIsDecorated(False)
        self.setIndentation(0)
        self.setItemsExpandable(False)
        self.setAllColumnsShowFocus(True)
        self.setTabKeyNavigation(False)
        self.setSelectionMode(QAbstractItemView.SelectionMode.SingleSelection)
        header = self.header()
        header.setSectionsMovable(False)
        header.setStretchLastSection(False)
        header.setSectionResizeMode(0, QHeaderView.ResizeMode.Stretch)
        for column in range(1, len(COLUMNS)):
            header.setSectionResizeMode(column, QHeaderView.ResizeMode.ResizeToContents)
        self.currentItemChanged.connect(self._on_current)
        self.itemActivated.connect(self._on_activated)

    @property
    def current(self) -> ListEntry | None:
        """Return what is selected; None before anything is."""
        item = self.currentItem()
        number = None if item is None else item.data(0, _PLACE)
        return None if number is None else self._entries[number]

    def show_all(
        self, ladder: Ladder, cases: list[KnownCase], selected: str = ""
    ) -> None:
        """Show the lines anew; selected: name of an exercise."""
        self.blockSignals(True)
        self.clear()
        self._entries = []
        wanted = None
        for level in Level:
            group = [e for e in ladder.exercises if e.scenario.level is level]
            self._add_heading(tr(str(level).capitalize()), bool(group))
            for exercise in group:
                item = self._add_exercise(exercise)
                wanted = item if exercise.name == selected else wanted
        self._add_heading(tr("Flights along a recorded path"), bool(ladder.others))
        for exercise in ladder.others:
            item = self._add_exercise(exercise)
            wanted = item if exercise.name == selected else wanted
        self._add_heading(tr("Cases"), True)
        for case in cases:
            self._add(ListEntry(case=case), [case.title, tr("open")], INK)
        self._add(ListEntry(), [tr(OPEN_CASE)], INK)
        self.blockSignals(False)
        if wanted is not None:
            self.setCurrentItem(wanted)
            self.scrollToItem(wanted)

    def select(self, exercise: str) -> None:
        """Select an exercise by name."""
        for row in range(self.topLevelItemCount()):
            item = self.topLevelItem(row)
            number = None if item is None else item.data(0, _PLACE)
            if number is None:
                continue
            found = self._entries[number].exercise
            if item is not None and found is not None and found.name == exercise:
                self.setCurrentItem(item)

    def _add_heading(self, text: str, has_lines: bool) -> None:
        if not has_lines:
            return
        item = QTreeWidgetItem(self, [text])
        item.setFlags(Qt.ItemFlag.NoItemFlags)
        item.setFirstColumnSpanned(True)
        font = self.font()
        font.setBold(True)
        item.setFont(0, font)
        item.setForeground(0, QColor(QUIET))

    def _add_exercise(self, exercise: Exercise) -> QTreeWidgetItem:
        attempts = exercise.attempts
        texts = [
            tr(exercise.scenario.title),
            tr(_MARKS.get(exercise.door, "open")),
            str(len(attempts)) if attempts else "",
            tr(attempt_text(attempts[-1], exercise.scenario)) if attempts else "",
            percent_text(exercise.best_percent),
        ]
        ink = QUIET if exercise.door is ExerciseStatus.LOCKED else INK
        item = self._add(ListEntry(exercise), texts, ink)
        if exercise.door is ExerciseStatus.PASSED:
            item.setForeground(1, QColor(READY))
        return item

    def _add(self, entry: ListEntry, texts: list[str], ink: object) -> QTreeWidgetItem:
        item = QTreeWidgetItem(self, texts)
        item.setData(0, _PLACE, len(self._entries))
        self._entries.append(entry)
        item.setToolTip(0, plain_tip(texts[0]))
        for column in range(len(COLUMNS)):
            item.setForeground(column, QColor(ink))
            if column > 1:
                right = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter
                item.setTextAlignment(column, right)
        return item

    def _on_current(self) -> None:
        if self.current is not None:
            self.selected.emit(self.current)

    def _on_activated(self) -> None:
        if self.current is not None:
            self.chosen.emit(self.current)


def percent_text(percent: float | None) -> str:
    """Return points as a text, empty for none."""
    return "" if percent is None else f"{percent:.0f}"
