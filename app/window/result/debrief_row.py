"""How far the debrief is, then where it lies."""

from pathlib import Path

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import (
    QApplication,
    QHBoxLayout,
    QProgressBar,
    QPushButton,
    QWidget,
)

from app.window.plain_label import PlainLabel
from app.window.scaling import lay
from app.window.texts import tr


class DebriefRow(QWidget):
    """Show a bar while a debrief is written and its place afterwards; hidden before."""

    folder_wanted = Signal(Path)
    """The folder that it lies in shall be opened."""

    def __init__(self) -> None:
        super().__init__()
        self._file = Path()
        self.words = PlainLabel()
        self.words.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        self.words.setWordWrap(True)
        self.bar = QProgressBar()
        self.bar.setTextVisible(False)
        self.copy, self.folder = (
            QPushButton(tr("Copy path")),
            QPushButton(tr("Open folder")),
        )
        self.copy.clicked.connect(self._copy)
        self.folder.clicked.connect(lambda: self.folder_wanted.emit(self._file.parent))
        row = lay(QHBoxLayout(self), 0)
        row.addWidget(self.words, 1)
        for part in (self.bar, self.copy, self.folder):
            row.addWidget(part)
        self.hide()

    def show_stage(self, stage: str, share: float = 0.0) -> None:
        """Say what is being written, and how far it is."""
        self.words.setText(tr("Debrief: {stage}", stage=stage))
        self.bar.setRange(0, 100 if share > 0.0 else 0)
        self.bar.setValue(round(100 * share))
        self._show(is_written=False)

    def show_file(self, file: Path, problem: str = "") -> None:
        """Say where it lies; problem: why it could not be opened."""
        self._file = file
        self.words.setText(
            tr("{problem} The debrief is in {file}", problem=problem, file=file).strip()
        )
        self._show(is_written=True)

    def _show(self, *, is_written: bool) -> None:
        self.bar.setVisible(not is_written)
        for button in (self.copy, self.folder):
            button.setVisible(is_written)
        self.show()

    def _copy(self) -> None:
        QApplication.clipboard().setText(str(self._file))
        self.copy.setText(tr("Copied"))
