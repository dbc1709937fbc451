"""Flights whose end is missing because the program was ended: what to do with them."""

from collections.abc import Sequence

from PySide6.QtCore import Signal, SignalInstance
from PySide6.QtWidgets import QFrame, QHBoxLayout, QPushButton

from app.window.plain_label import PlainLabel
from app.window.scaling import lay
from app.window.texts import tr
from paravol.sessions.unfinished_sessions import UnfinishedSession


class RecoveryCard(QFrame):
    """Offer one unfinished recording after the other; hidden where there are none."""

    recover_wanted = Signal(object)
    """Give the recording its end, score it and show its result."""
    keep_wanted = Signal(object)
    """Leave it as it is, and do not ask again."""
    discard_wanted = Signal(object)
    """Remove it."""

    def __init__(self) -> None:
        super().__init__()
        self.setObjectName("card")
        self.setProperty("marked", True)
        self._left: list[UnfinishedSession] = []
        self._text = PlainLabel(name="body", wraps=True)
        self.recover = QPushButton(tr("Recover"))
        self.keep = QPushButton(tr("Keep as it is"))
        self.discard = QPushButton(tr("Discard"))
        row = lay(QHBoxLayout(self), 14, 8, 14, 8, gap=8)
        row.addWidget(self._text, 1)
        for button, wanted in (
            (self.recover, self.recover_wanted),
            (self.keep, self.keep_wanted),
            (self.discard, self.discard_wanted),
        ):
            row.addWidget(button)
            button.clicked.connect(lambda _=False, wanted=wanted: self._answer(wanted))
        self.hide()

    def show_unfinished(self, found: Sequence[UnfinishedSession]) -> None:
        """Offer recordings, one after the other."""
        self._left = list(found)
        self._show_first()

    def _show_first(self) -> None:
        self.setVisible(bool(self._left))
        if self._left:
            first, more = self._left[0], len(self._left) - 1
            begun = first.created[:16].replace("T", " ")
            text = tr(
                "A flight was cut off: {title}, {length_s:.0f} s, begun "
                "{begun}. Its recording is there up to the last half "
                "second.",
                title=tr(first.title),
                length_s=first.length_s,
                begun=begun,
            )
            if more:
                text += tr(" {more} more follow.", more=more)
            self._text.setText(text)

    def _answer(self, wanted: SignalInstance) -> None:
        session = self._left.pop(0)
        self._show_first()
        wanted.emit(session)
