"""The column beside a replay: where the scope is, what happened, figures, notes."""

import re
from collections.abc import Iterable, Sequence

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import (
    QHBoxLayout,
    QHeaderView,
    QLabel,
    QLineEdit,
    QListWidget,
    QListWidgetItem,
    QPushButton,
    QTabWidget,
    QTreeWidget,
    QTreeWidgetItem,
    QVBoxLayout,
    QWidget,
)

from app.window.keyboard import key_map
from app.window.plain_label import PlainLabel, plain_tip
from app.window.replay.time_line import clock_text
from app.window.scaling import lay
from app.window.session_page import SessionSide
from app.window.texts import later, tr
from paravol.sessions.replay_events import Row
from scenarios import Scenario
from scenarios.bundle.notes import LONGEST_NOTE

_TIME = Qt.ItemDataRole.UserRole

KEYS = (
    (later("Space"), later("play, pause")),
    ("← →", later("a frame back, ahead; Shift: a second")),
    ("↑ ↓", later("faster, slower")),
    (later("Pg↑ Pg↓"), later("event before, after")),
    (later("Home End"), later("to the begin, to the end")),
    ("V", later("leave the recorded view, come back")),
    (later("drag, wheel"), later("look around, go ahead")),
    ("@W @S @A @D", later("ahead, back, left, right")),
    ("@R @F @Z @X", later("up, down; roll")),
    ("K", later("draw this moment at high quality")),
    ("N", later("write a note")),
    ("B  L", later("compare with another; align")),
    ("M  C", later("slices: CT, MR, both; open the head")),
    ("I", later("hint to the task")),
    ("O", later("open another session")),
    ("F  Q  F1", later("full screen; leave; this list")),
)


class MomentList(QListWidget):
    """List moments with their seconds; one that is chosen is gone to."""

    sought = Signal(float)
    """Somebody wants to go to this second."""

    def __init__(self, name: str) -> None:
        """Begin empty; name: for who cannot see it."""
        super().__init__()
        self.setAccessibleName(name)
        self.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self.setWordWrap(True)
        self.itemActivated.connect(self._seek)
        self.itemClicked.connect(self._seek)

    def _seek(self, item: QListWidgetItem) -> None:
        self.sought.emit(item.data(_TIME))

    def show_moments(self, moments: Iterable[tuple[float, str]]) -> None:
        """List these seconds, each with its text."""
        self.clear()
        for time_s, text in moments:
            item = QListWidgetItem(f"{clock_text(time_s)}  {text}")
            item.setData(_TIME, time_s)
            self.addItem(item)


class MetricTable(QTreeWidget):
    """Show a session's metrics, beside another's where two are compared."""

    def __init__(self) -> None:
        super().__init__()
        self.setAccessibleName(tr("Metrics"))
        self.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self.setRootIsDecorated(False)
        self.setWordWrap(True)
        self.setColumnCount(2)
        self.setHeaderLabels([tr("Metric"), tr("Value")])
        self.header().setSectionResizeMode(QHeaderView.ResizeMode.Stretch)

    def say(self, text: str, why: str = "") -> None:
        """Say that there is nothing to show, or not yet, and why."""
        self.setColumnCount(1)
        self.setHeaderLabels([text])
        self.clear()
        if why:
            item = QTreeWidgetItem([why])
            item.setToolTip(0, plain_tip(why))
            self.addTopLevelItem(item)

    def show_rows(self, rows: Sequence[Row]) -> None:
        """Show these rows."""
        is_compared = any(other for _, _, other in rows)
        labels = [tr("Metric"), tr("This session"), tr("The other")]
        self.setColumnCount(3 if is_compared else 2)
        self.setHeaderLabels(labels if is_compared else [tr("Metric"), tr("Value")])
        self.clear()
        for row in rows:
            texts = [tr(text) for text in row]
            item = QTreeWidgetItem(texts)
            for column, text in enumerate(texts):
                item.setToolTip(column, plain_tip(text))
            self.addTopLevelItem(item)


class NoteBook(QWidget):
    """Show a teacher's notes; write one about now, remove the chosen one."""

    written = Signal(str)
    """A note about what is shown now."""
    removed = Signal(int)
    """The note of this number, from 1 on, is to go."""

    def __init__(self) -> None:
        super().__init__()
        self.notes = MomentList(tr("Notes"))
        self.line = QLineEdit()
        self.line.setAccessibleName(tr("Note about this moment"))
        self.line.setPlaceholderText(tr("Note about this moment; Enter keeps it"))
        self.line.setMaxLength(LONGEST_NOTE)
        self.line.returnPressed.connect(self._write)
        self.remove = QPushButton(tr("Remove"))
        self.remove.clicked.connect(self._remove)
        column = lay(QVBoxLayout(self), 0)
        column.addWidget(self.notes, 1)
        row = QHBoxLayout()
        row.addWidget(self.line, 1)
        row.addWidget(self.remove)
        column.addLayout(row)

    def _write(self) -> None:
        text = self.line.text().strip()
        if text:
            self.written.emit(text)
            self.line.clear()

    def _remove(self) -> None:
        if self.notes.currentRow() >= 0:
            self.removed.emit(self.notes.currentRow() + 1)


class ReplaySide(SessionSide):
    """Show overview, slices and tasks of one session, and its tabs."""

    def __init__(self, scenario: Scenario, edge_samples: int) -> None:
        """Lay out the column; edge_samples: for the overview."""
        super().__init__(scenario, edge_samples)
        self.events = MomentList(tr("Events"))
        self.metrics = MetricTable()
        self.book = NoteBook()
        self.tabs = QTabWidget()
        self.tabs.setDocumentMode(True)
        self.tabs.tabBar().setDrawBase(False)
        self.tabs.tabBar().setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self.tabs.addTab(self.events, tr("Events"))
        self.tabs.addTab(self.metrics, tr("Metrics"))
        self.tabs.addTab(self.book, tr("Notes"))
        self._keys = _keys()
        self.tabs.addTab(self._keys, tr("Keys"))
        column = lay(QVBoxLayout(self), 12, 8, 12, 8, gap=6)
        column.addWidget(self.title)
        column.addWidget(self.tasks)
        column.addWidget(self._tool)
        column.addWidget(self.overview, 3)
        column.addWidget(self.slices)
        column.addWidget(self._info)
        column.addWidget(self.tabs, 4)
        column.addWidget(self.moments)

    def show_keys(self) -> None:
        """Show what the keys do."""
        self.tabs.setCurrentWidget(self._keys)

    def write_note(self) -> None:
        """Let somebody type a note."""
        self.tabs.setCurrentWidget(self.book)
        self.book.line.setFocus()


def _keys() -> QWidget:
    words = QTreeWidget()
    words.setAccessibleName(tr("Keys"))
    words.setFocusPolicy(Qt.FocusPolicy.TabFocus)
    words.setRootIsDecorated(False)
    words.setColumnCount(2)
    words.setHeaderHidden(True)
    for key, does in KEYS:
        # of a place, what the user's keyboard prints there
        shown = re.sub("@(.)", lambda found: key_map.KEYS.printed[found[1]], tr(key))
        words.addTopLevelItem(QTreeWidgetItem([shown, tr(does)]))
    words.header().setSectionResizeMode(0, QHeaderView.ResizeMode.ResizeToContents)
    return words


def caption() -> QLabel:
    """Return a line below a picture that says which session it is, and when."""
    label = PlainLabel(name="caption")
    label.setAlignment(Qt.AlignmentFlag.AlignCenter)
    return label
