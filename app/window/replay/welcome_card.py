"""What the replay page shows while no session is open: where to take one from."""

import re
from collections.abc import Sequence
from pathlib import Path

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import (
    QFrame,
    QHBoxLayout,
    QListWidget,
    QListWidgetItem,
    QPushButton,
    QVBoxLayout,
    QWidget,
)

from app.window.page_style import page_sheet
from app.window.plain_label import PlainLabel, paragraph
from app.window.scaling import Scaled, lay
from app.window.texts import later, tr

WELCOME = later("Which session shall be replayed?")
HOW = later(
    "Drop a folder NAME.paravol on the window, or two of them to compare them; "
    "or choose one of your last flights."
)
MOST = 50
_AUTOMATIC = re.compile(r"(\d{4}-\d\d-\d\d)_(\d\d)-(\d\d)-\d\d_(.+)\.paravol")
"""Names of sessions that were recorded without being asked."""


class WelcomeCard(QWidget, Scaled):
    """Offer the last flights, and a folder of one's own."""

    chosen = Signal(Path)
    """A session shall be opened."""

    def __init__(self) -> None:
        super().__init__()
        self.setObjectName("page")
        self.setAttribute(Qt.WidgetAttribute.WA_StyledBackground)
        self.recent = _RecentList()
        self.recent.setAccessibleName(tr("The last flights, the newest first"))
        self.open = QPushButton(tr("Open a folder… (O)"))
        self.open.setObjectName("primary")
        self.leave = QPushButton(tr("Leave (Q)"))
        card = QFrame()
        card.setObjectName("card")
        buttons = QHBoxLayout()
        buttons.addWidget(self.leave)
        buttons.addStretch(1)
        buttons.addWidget(self.open)
        column = lay(QVBoxLayout(card), 16, gap=10)
        column.addWidget(PlainLabel(tr(WELCOME), "heading"))
        column.addWidget(paragraph(tr(HOW)))
        column.addWidget(self.recent, 1)
        column.addLayout(buttons)
        around = lay(QHBoxLayout(self), 16, 48, 16, 48)
        around.addStretch(1)
        around.addWidget(card, 3)
        around.addStretch(1)
        self.recent.itemActivated.connect(self._choose)
        self.show_recent([])

    def take_scale(self) -> None:
        """Look like a page of text."""
        self.setStyleSheet(page_sheet(self.scale))

    def show_recent(self, sessions: Sequence[Path]) -> None:
        """List sessions, the newest first."""
        self.recent.clear()
        for folder in sessions[:MOST]:
            item = QListWidgetItem(title_of(folder))
            item.setData(Qt.ItemDataRole.UserRole, folder)
            self.recent.addItem(item)
        if sessions:
            self.recent.setCurrentRow(0)
            if self.isVisible():
                self.recent.setFocus()
        else:
            none = QListWidgetItem(tr("No flight is recorded yet."))
            none.setFlags(Qt.ItemFlag.NoItemFlags)
            self.recent.addItem(none)

    def _choose(self, item: QListWidgetItem) -> None:
        folder = item.data(Qt.ItemDataRole.UserRole)
        if folder is not None:
            self.chosen.emit(folder)


class _RecentList(QListWidget):
    """Leave letters to the page: Qt would look for lines that begin with them."""

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.text().isprintable() and event.text():
            event.ignore()
        else:
            super().keyPressEvent(event)


def title_of(folder: Path) -> str:
    """Return when and what was flown, by a session's name; others keep their name."""
    found = _AUTOMATIC.fullmatch(folder.name)
    if found is None:
        return folder.name
    day, hour, minute, name = found.groups()
    exercise = name.replace("-", " ")
    return f"{day}  {hour}:{minute}   {tr(exercise)}"
