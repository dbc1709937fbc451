"""The row of figures under the picture."""

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QHBoxLayout, QLabel, QVBoxLayout, QWidget

from paravol.readings import UNKNOWN, Readings


class Gauges(QWidget):
    """Show readings, each under its caption; the clearance turns red in time."""

    def __init__(self) -> None:
        super().__init__()
        self.setObjectName("gauges")
        self.setAttribute(Qt.WidgetAttribute.WA_StyledBackground)
        row = self._row = QHBoxLayout(self)
        self._figures: dict[str, QLabel] = {}
        for caption in Readings().texts():
            column = QVBoxLayout()
            column.setSpacing(0)
            above, figure = QLabel(caption), QLabel(UNKNOWN)
            above.setObjectName("caption")
            figure.setObjectName("figure")
            column.addWidget(above)
            column.addWidget(figure)
            row.addLayout(column, 1)
            self._figures[caption] = figure

    def set_scale(self, scale: float) -> None:
        """Scale the layout; 1 is the designed size."""
        self._row.setContentsMargins(*(round(n * scale) for n in (24, 5, 24, 6)))
        self._row.setSpacing(round(18 * scale))

    def show_readings(self, readings: Readings) -> None:
        """Show figures; only what has changed is laid out anew."""
        for caption, text in readings.texts().items():
            figure = self._figures[caption]
            if figure.text() != text:
                figure.setText(text)
        clearance = self._figures["Clearance"]
        if clearance.property("alarming") != readings.is_alarming:
            clearance.setProperty("alarming", readings.is_alarming)
            # Qt looks style rules up again only when asked to.
            clearance.style().unpolish(clearance)
            clearance.style().polish(clearance)
