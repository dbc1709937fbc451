"""The page of a flight that could not begin or go on: why, and where to go from it."""

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QHBoxLayout, QPushButton, QVBoxLayout

from app.window.keyboard.places import american
from app.window.page import TextPage
from app.window.plain_label import PlainLabel
from app.window.scaling import lay
from app.window.texts import tr


class EndedPage(TextPage):
    """What ended a flight of which there is no result."""

    again_wanted = Signal()
    home_wanted = Signal()

    def __init__(self, title: str, problem: str) -> None:
        """Lay the page out; title: of the exercise."""
        super().__init__()
        self.title = f"PARAVOL: {tr(title)}"
        heading = PlainLabel(tr("This flight has ended"), "verdict")
        about = PlainLabel(tr(title), "heading")
        self.again, self.home = (
            QPushButton(tr("Again (A)")),
            QPushButton(tr("Home (H)")),
        )
        self.again.setObjectName("primary")
        self.again.clicked.connect(self.again_wanted)
        self.home.clicked.connect(self.home_wanted)
        buttons = QHBoxLayout()
        buttons.addStretch(1)
        buttons.addWidget(self.home)
        buttons.addWidget(self.again)
        rows = lay(QVBoxLayout(self), 16, gap=10)
        for part in (heading, about, self.problem, self.stage, self.share):
            rows.addWidget(part)
        rows.addStretch(1)
        rows.addLayout(buttons)
        self.say(problem)
        self.show_stage("")

    def showEvent(self, event: object) -> None:
        """Let Enter fly once more."""
        self.again.setFocus()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Press the button of a key."""
        match american(event):
            case Qt.Key.Key_A:
                self.again.click()
            case Qt.Key.Key_H | Qt.Key.Key_Escape:
                self.home.click()
            case Qt.Key.Key_F11:
                self.full_screen_wanted.emit()
            case _:
                super().keyPressEvent(event)
