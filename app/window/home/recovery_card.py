"""Flights whose end is missing because the program was ended: what to do with them."""

from collections.abc import Sequence
from pathlib import Path

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QFrame, QHBoxLayout, QLabel, QPushButton


class RecoveryCard(QFrame):
    """Offer one unfinished recording after the other; hidden where there are none."""

    recover_wanted = Signal(Path)
    """Give the recording its end, score it and show its result."""
    keep_wanted = Signal(Path)
    """Leave it as it is, and do not ask again."""
    discard_wanted = Signal(Path)
    """Remove it."""

    def __init__(self) -> None:
        super().__init__()
        self.setObjectName("card")
        self.setProperty("marked", True)
        self._left: list[tuple[Path, str]] = []
        self._text = QLabel()
        self._text.setObjectName("body")
        self._text.setWordWrap(True)
        self._text.setTextFormat(Qt.TextFormat.PlainText)
        self.recover = QPushButton("Recover")
        self.keep = QPushButton("Keep as it is")
        self.discard = QPushButton("Discard")
        self._row = QHBoxLayout(self)
        self._row.addWidget(self._text, 1)
        for button, wanted in (
            (self.recover, self.recover_wanted),
            (self.keep, self.keep_wanted),
            (self.discard, self.discard_wanted),
        ):
            self._row.addWidget(button)
            button.clicked.connect(lambda _=False, wanted=wanted: self._answer(wanted))
        self.hide()

    def set_scale(self, scale: float) -> None:
        """Scale the layout; 1 is the designed size."""
        self._row.setContentsMargins(*(round(n * scale) for n in (14, 8, 14, 8)))
        self._row.setSpacing(round(8 * scale))

    def show_unfinished(self, found: Sequence[tuple[Path, str]]) -> None:
        """Offer recordings: folders, and what is known of each."""
        self._left = list(found)
        self._show_first()

    def _show_first(self) -> None:
        self.setVisible(bool(self._left))
        if self._left:
            more = f" ({len(self._left) - 1} more)" if self._left[1:] else ""
            self._text.setText(
                f"A flight was cut off before its end: {self._left[0][1]}{more}. "
                "Its recording is there up to the last half second."
            )

    def _answer(self, wanted: object) -> None:
        folder, _ = self._left.pop(0)
        self._show_first()
        wanted.emit(folder)  # type: ignore[attr-defined]
