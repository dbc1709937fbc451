"""Words on a page: text from outside is text, however much it looks like markup."""

import html

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QLabel, QMessageBox, QWidget

from system.plain_text import plain


class PlainLabel(QLabel):
    """A label that shows every letter of its text; Qt's own guesses at rich text."""

    def __init__(self, text: str = "", name: str = "", *, wraps: bool = False) -> None:
        """Show a text; name: by which style sheets know it. wraps: into more lines."""
        super().__init__(plain(text))
        self.setTextFormat(Qt.TextFormat.PlainText)
        self.setObjectName(name)
        self.setWordWrap(wraps)

    def setText(self, text: str) -> None:
        """Show other words."""
        super().setText(plain(text))


def paragraph(text: str, name: str = "") -> PlainLabel:
    """Return a label that takes as many lines as it needs."""
    return PlainLabel(text, name, wraps=True)


def plain_tip(text: str) -> str:
    """Return what a tool tip shows as this text; it has no format of its own."""
    return f"<qt>{html.escape(plain(text))}</qt>" if "<" in text else plain(text)


def warning_box(title: str, text: str, parent: QWidget) -> QMessageBox:
    """Return a box with an OK button that shows a text as it is."""
    icon, button = QMessageBox.Icon.Warning, QMessageBox.StandardButton.Ok
    box = QMessageBox(icon, plain(title), "", button, parent)
    box.setTextFormat(Qt.TextFormat.PlainText)
    box.setText(plain(text))
    return box
