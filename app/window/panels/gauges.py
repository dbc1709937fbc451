"""The line below the page: figures of the flight, and quietly how well all goes."""

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QHBoxLayout, QLabel, QWidget

from app.window.plain_label import PlainLabel
from app.window.scaling import Scaled, lay
from app.window.texts import later, tr
from paravol.scoring.readings import UNKNOWN, Readings

SHOWN = (later("Time"), later("Clearance"), later("Nostril"))
"""Of the readings; the nearest hazard is on its bar, the rest in the quiet line."""


class Gauges(QWidget, Scaled):
    """Show readings, each beside its caption; the clearance is coloured in time."""

    def __init__(self) -> None:
        super().__init__()
        self.setObjectName("gauges")
        self.setAttribute(Qt.WidgetAttribute.WA_StyledBackground)
        row = lay(QHBoxLayout(self), 14, 4, 14, 4, gap=8)
        self._figures: dict[str, QLabel] = {}
        for caption in SHOWN:
            self._figures[caption] = PlainLabel(UNKNOWN, "figure")
            row.addWidget(PlainLabel(tr(caption), "caption"))
            row.addWidget(self._figures[caption])
        self.status = PlainLabel(name="status")
        # it has room to become longer at once
        right = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter
        self.status.setAlignment(right)
        self.status.setWordWrap(True)
        row.addWidget(self.status, 1)

    def take_scale(self) -> None:
        """Keep figures apart from the next one's caption."""
        for figure in self._figures.values():
            figure.setContentsMargins(0, 0, round(24 * self.scale), 0)

    def show_readings(self, readings: Readings) -> None:
        """Show figures; only what has changed is laid out anew."""
        texts = {caption: tr(text) for caption, text in readings.texts().items()}
        for caption, figure in self._figures.items():
            if figure.text() != texts[caption]:
                figure.setText(texts[caption])
        clearance = self._figures["Clearance"]
        if clearance.property("alarming") != readings.is_alarming:
            clearance.setProperty("alarming", readings.is_alarming)
            # Qt looks style rules up again only when asked to.
            clearance.style().unpolish(clearance)
            clearance.style().polish(clearance)

    def show_status(self, text: str) -> None:
        """Show the quiet line."""
        if self.status.text() != text:
            self.status.setText(text)
