"""A page of the main window: one of them is shown at a time."""

from collections.abc import Callable
from threading import Thread

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QLabel, QProgressBar, QPushButton, QWidget

from app.window.page_style import page_sheet
from app.window.plain_label import PlainLabel
from app.window.scaling import scale_all


class Page(QWidget):
    """Fill the main window. Keys go to the page that is shown, or to its parts."""

    left = Signal()
    """Whoever sits there is done with the page; it `may_leave` already."""

    full_screen_wanted = Signal()
    """The window shall fill the screen, or no longer."""

    scale = 1.0
    """Factor on every font and length."""

    sheet: Callable[[float], str] = staticmethod(lambda scale: "")
    """Returns the page's own rules at a scale."""

    title = "PARAVOL"
    """What the window's frame says while the page is shown."""

    def __init__(self) -> None:
        super().__init__()
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)

    def set_scale(self, scale: float) -> None:
        """Scale fonts and lengths; 1 is the size that the window was designed at."""
        self.scale = scale
        self.setStyleSheet(self.sheet(scale))
        scale_all(self, scale)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Press the button that has the focus by Enter, as Space does."""
        pressed = self.focusWidget()
        if isinstance(pressed, QPushButton) and event.key() in (
            Qt.Key.Key_Return,
            Qt.Key.Key_Enter,
        ):
            pressed.click()
        else:
            super().keyPressEvent(event)

    def may_leave(self) -> bool:
        """Return whether the page may be left now; else it asks by itself."""
        return True

    def covered(self, is_on: bool) -> None:
        """Hear that a dialog stands over the page, or no longer."""

    def catch_up(self) -> None:
        """Draw what waits: a picture of the window is about to be taken."""

    def release(self) -> list[Thread]:
        """End what the page has going on, and free graphics memory; returns at once.

        Called once, when the page is never shown again. Returns what ends beside the
        window: only the program's end waits for it.
        """
        return []


class TextPage(Page):
    """A page on which it can be said what is being done, and what went wrong.

    problem, stage, share: the parts that say it, for whoever lays the page out.
    """

    sheet = staticmethod(page_sheet)

    def __init__(self) -> None:
        super().__init__()
        self.setObjectName("page")
        self.problem = problem_label()
        self.stage = PlainLabel()
        self.share = QProgressBar()
        self.share.setTextVisible(False)

    def say(self, problem: str) -> None:
        """Say what went wrong; "" takes it away."""
        self.problem.setText(problem)
        self.problem.setVisible(bool(problem))

    def show_stage(self, stage: str, share: float = 0.0) -> None:
        """Say what is being done, and how far it is; "" for nothing."""
        self.stage.setText(stage)
        for part in (self.stage, self.share):
            part.setVisible(bool(stage))
        self.share.setRange(0, 100 if share > 0.0 else 0)
        self.share.setValue(round(100 * share))


def problem_label() -> QLabel:
    """Return a box, hidden at first, for what went wrong; its text can be copied."""
    label = PlainLabel(name="problem", wraps=True)
    label.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
    label.hide()
    return label
