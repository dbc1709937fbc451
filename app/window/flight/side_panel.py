"""The column beside the endoscope's picture: what to do, and where one is."""

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QVBoxLayout, QWidget

from app.window.keyboard.actions import Act
from app.window.keyboard.key_map import KEYS
from app.window.plain_label import PlainLabel
from app.window.scaling import lay
from app.window.session_page import SessionSide
from app.window.texts import tr
from paravol.flight.flight import FlightOrder
from scenarios.instrument_state import EMPTY_HAND


class SideColumn(SessionSide):
    """Show tasks, the tool in hand, overview, slices and kept moments, in a column."""

    def __init__(self, order: FlightOrder, edge_samples: int) -> None:
        """Lay out the column; edge_samples: for the overview."""
        super().__init__(order.scenario, edge_samples)
        self.setAttribute(Qt.WidgetAttribute.WA_StyledBackground)
        scope, second = order.scenario.scope, order.instrument
        self.show_tool(EMPTY_HAND)
        about = PlainLabel(
            tr(
                "{diameter_mm:g} mm scope · {name}",
                diameter_mm=scope.diameter_mm,
                name=tr(order.input.name),
            )
            + ("" if second is None else tr(" · tool: {name}", name=tr(second.name)))
            + tr(" · {help}: all keys", help=KEYS.label(Act.HELP))
        )
        about.setWordWrap(True)
        self._column = lay(QVBoxLayout(self), 16, 10, 16, 8, gap=5)
        self._column.addWidget(self.title)
        self._column.addWidget(about)
        self._column.addWidget(self.tasks)
        self._column.addWidget(self._tool)
        self._column.addWidget(self.overview, 1)
        self._column.addWidget(self.slices)
        self._column.addWidget(self._info)
        self._column.addWidget(self.moments)

    def replace(self, before: QWidget, after: QWidget) -> None:
        """Put another widget into the place of one; all have their share of room."""
        self._column.replaceWidget(before, after)
        for widget in (self.overview, after):
            if self._column.indexOf(widget) >= 0:
                is_fixed = widget is self.slices
                self._column.setStretchFactor(widget, 0 if is_fixed else 1)
