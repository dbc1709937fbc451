"""The column beside the endoscope's picture: where it is, and which keys there are."""

from PySide6.QtWidgets import QLabel, QVBoxLayout, QWidget

from app.window.flight.keys import TASK_KEYS, KeyHelp
from app.window.flight.sound_keys import SOUND_KEYS
from app.window.flight.tool_keys import TOOL_KEYS
from app.window.panels.moments import MomentView
from app.window.panels.overview_panel import OverviewView
from app.window.panels.slices_panel import SlicesView
from app.window.panels.task_panel import TaskPanel
from paravol.flight import FlightOrder
from paravol.readings import tool_text
from scenarios import InstrumentState
from scenarios.instrument_state import EMPTY_HAND


class SideColumn(QWidget):
    """Show overview, slices, kept moments and keys, one below the other."""

    def __init__(self, order: FlightOrder, edge_samples: int) -> None:
        """Lay out the column; edge_samples: for the overview."""
        super().__init__()
        self.setObjectName("side")
        scope = order.scenario.scope
        self.overview = OverviewView(scope.endoscope(), edge_samples)
        self.slices = SlicesView()
        self.moments = MomentView()
        self.tasks = TaskPanel(order.scenario)
        own = order.has_own_tool
        second = order.instrument
        keys = order.input.keys if second is None else order.input.keys | second.keys
        hand_keys = SOUND_KEYS if own else TOOL_KEYS | SOUND_KEYS
        if order.scenario.tasks:
            hand_keys = TASK_KEYS | hand_keys
        self._keys = KeyHelp(keys, hand_keys)
        self._tool = QLabel(tool_text(EMPTY_HAND))
        title = QLabel(order.scenario.title)
        title.setObjectName("title")
        title.setWordWrap(True)
        about = QLabel(
            f"{scope.angle_deg:g}° scope, {scope.diameter_mm:g} mm · {order.input.name}"
            + ("" if second is None else f" · tool: {second.name}")
        )
        about.setWordWrap(True)
        self._column = QVBoxLayout(self)
        self._column.addWidget(title)
        self._column.addWidget(about)
        self._column.addWidget(self._tool)
        self._column.addWidget(self.tasks)
        self._column.addWidget(self.overview, 1)
        self._column.addWidget(self.slices)
        self._column.addWidget(self.moments)
        self._column.addWidget(self._keys)

    def show_tool(self, tool: InstrumentState) -> None:
        """Say which tool is in hand, and what it does."""
        text = tool_text(tool)
        if self._tool.text() != text:
            self._tool.setText(text)

    def set_scale(self, scale: float) -> None:
        """Scale the layout; 1 is the designed size."""
        self._column.setContentsMargins(*(round(n * scale) for n in (18, 10, 18, 8)))
        self._column.setSpacing(round(5 * scale))
        for part in (
            self.tasks,
            self.overview,
            self.slices,
            self.moments,
            self._keys,
        ):
            part.set_scale(scale)
