"""Buttons of a playback: play, step, speed, events, and what else can be done."""

from PySide6.QtCore import Qt, Signal, SignalInstance
from PySide6.QtWidgets import (
    QComboBox,
    QHBoxLayout,
    QPushButton,
    QVBoxLayout,
    QWidget,
)

from app.window.plain_label import PlainLabel
from app.window.replay.time_line import clock_text
from app.window.scaling import lay
from app.window.texts import later, tr

SPEEDS = (0.1, 0.25, 0.5, 1.0, 2.0, 5.0, 10.0)
PLAY, PAUSE = later("▶ Play"), later("❚❚ Pause")


class Transport(QWidget):
    """Show the buttons below a time line; each emits what it is for."""

    played = Signal()
    stepped = Signal(int)
    """So many frames ahead."""
    event_wanted = Signal(int)
    """The next event (1) or the one before (-1)."""
    sped = Signal(float)
    """Seconds of the session in one second."""

    def __init__(self) -> None:
        super().__init__()
        self.play = self._button(tr(PLAY), tr("Play or pause (Space)"))
        self.play.clicked.connect(lambda: self.played.emit())
        self.speed = QComboBox()
        self.speed.setAccessibleName(tr("Speed"))
        self.speed.setToolTip(tr("Speed (↑ ↓)"))
        for speed in SPEEDS:
            self.speed.addItem(f"{speed:g}x", speed)
        self.speed.setCurrentIndex(SPEEDS.index(1.0))
        self.speed.activated.connect(lambda _: self._speed())
        self.clock = PlainLabel(clock_text(0.0), "clock")
        self.state = PlainLabel(name="caption")
        self.own = self._button(
            tr("Own view"), tr("Leave the recorded view, come back (V)")
        )
        self.own.setCheckable(True)
        self.keep = self._button(tr("High quality"), tr("Draw this moment anew (K)"))
        self.note = self._button(tr("Note"), tr("Write a note about this moment (N)"))
        self.compare = self._button(
            tr("Compare…"), tr("Show another session beside it (B)")
        )
        self.align = QComboBox()
        self.align.setAccessibleName(tr("Align by"))
        self.align.setToolTip(tr("What ties both sessions together (L)"))
        self.align.addItems([tr("by landmarks"), tr("by time")])
        self.align.hide()
        self.open = self._button(tr("Open…"), tr("Open another session (O)"))
        self.leave = self._button(tr("Leave (Q)"), tr("Leave the replay (Q)"))
        rows = lay(QVBoxLayout(self), 10, 4, 10, 6, gap=4)
        first, second = lay(QHBoxLayout(), gap=6), lay(QHBoxLayout(), gap=6)
        for text, tip, signal, step in (
            ("«", tr("The event before (Page up)"), self.event_wanted, -1),
            ("◂", tr("A frame back (←)"), self.stepped, -1),
            ("▸", tr("A frame ahead (→)"), self.stepped, 1),
            ("»", tr("The next event (Page down)"), self.event_wanted, 1),
        ):
            first.addWidget(self._stepper(text, tip, signal, step))
        first.insertWidget(2, self.play)
        first.addWidget(self.speed)
        first.addWidget(self.clock)
        first.addStretch(1)
        first.addWidget(self.state)
        for button in (self.own, self.keep, self.note, self.compare):
            second.addWidget(button)
        second.addWidget(self.align)
        second.addStretch(1)
        second.addWidget(self.open)
        second.addWidget(self.leave)
        rows.addLayout(first)
        rows.addLayout(second)
        self._needing = [
            part
            for part in self.findChildren(QWidget)
            if isinstance(part, QPushButton | QComboBox)
            and part not in (self.open, self.leave)
        ]
        self.set_ready(False)
        for part in self.findChildren(QWidget):
            # who clicks wants the page to have the keys
            if part.focusPolicy() != Qt.FocusPolicy.NoFocus:
                part.setFocusPolicy(Qt.FocusPolicy.TabFocus)

    def _button(self, text: str, tip: str) -> QPushButton:
        button = QPushButton(text)
        button.setToolTip(tip)
        button.setAccessibleName(tip)
        return button

    def _stepper(
        self, text: str, tip: str, signal: SignalInstance, step: int
    ) -> QPushButton:
        button = self._button(text, tip)
        button.setAutoRepeat(True)
        button.clicked.connect(lambda: signal.emit(step))
        return button

    def set_ready(self, is_ready: bool) -> None:
        """Offer all buttons where there is a session, else to open one or to leave."""
        for part in self._needing:
            part.setEnabled(is_ready)

    def show_playing(self, is_playing: bool) -> None:
        """Say what the button does next."""
        text = tr(PAUSE if is_playing else PLAY)
        if self.play.text() != text:
            self.play.setText(text)

    def show_clock(self, time_s: float, end_s: float) -> None:
        """Show where one is, and where the end is."""
        text = f"{clock_text(time_s)} / {clock_text(end_s)}"
        if self.clock.text() != text:
            self.clock.setText(text)

    def say(self, text: str) -> None:
        """Say what is shown."""
        if self.state.text() != text:
            self.state.setText(text)

    def change_speed(self, step: int) -> None:
        """Take the next higher or lower speed."""
        place = min(max(self.speed.currentIndex() + step, 0), len(SPEEDS) - 1)
        self.speed.setCurrentIndex(place)
        self._speed()

    def _speed(self) -> None:
        self.sped.emit(self.speed.currentData())
