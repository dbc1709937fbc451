"""What the pages of a flight and of a replay show alike: a session, as it is seen."""

import time
from threading import Thread

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QTimer, Slot
from PySide6.QtWidgets import QWidget

from app.window.page import Page
from app.window.panels.endoscope_panel import PictureView
from app.window.panels.gauges import Gauges
from app.window.panels.moments import MomentView
from app.window.panels.notices import Notices
from app.window.panels.overview_panel import OverviewView
from app.window.panels.slices_panel import SlicesView
from app.window.panels.task_panel import TaskPanel
from app.window.panels.touch_bars import TouchBars, hazard_look
from app.window.plain_label import PlainLabel
from app.window.style import OVER
from app.window.texts import tr
from paravol.feedback import TouchSigns
from paravol.feedback.hazard_pointer import HazardPointer
from paravol.scoring.readings import tool_text
from paravol.slices.side_letters import looks_towards, side_letters
from scenarios import FrameState, InstrumentState, Scenario


def with_patient(scenario: Scenario) -> str:
    """Return an exercise's title, with the patient's number where one is drawn."""
    title = tr(scenario.title)
    if not scenario.head.patients:
        return title
    return tr("{title} · patient {number}", title=title, number=scenario.head.number)


class SessionSide(QWidget):
    """What stands beside the picture of a flight, and of a replay."""

    def __init__(self, scenario: Scenario, edge_samples: int) -> None:
        """Make the parts; edge_samples: samples a pixel for the overview's edges."""
        super().__init__()
        self.setObjectName("side")
        self.overview = OverviewView(scenario.scope.endoscope(), edge_samples)
        self.slices = SlicesView()
        self.moments = MomentView()
        self.tasks = TaskPanel(scenario)
        self.title = PlainLabel(with_patient(scenario), "title", wraps=True)
        self._tool = PlainLabel(name="tool", wraps=True)
        self._info = PlainLabel(name="status", wraps=True)
        self.slices.told.connect(self._info.setText)

    def show_tool(self, tool: InstrumentState) -> None:
        """Say which tool is in hand, and what it does."""
        text = tr("In hand: {tool}", tool=tr(tool_text(tool)))
        if self._tool.text() != text:
            self._tool.setText(text)

    def refresh(self) -> None:
        """Show tissue that was cut or put back."""
        self.slices.refresh()
        self.overview.refresh()


class SessionPage(Page):
    """Show the scope's picture, signs and readings, with a side that may come later.

    The overview is drawn when it is stale, but not before `_overview_due_s`: a picture
    of it by software takes time from the scope's.
    """

    _side: SessionSide | None = None

    def __init__(self, tick_ms: int) -> None:
        """Make the parts; tick_ms: between two calls of `_tick`."""
        super().__init__()
        self.picture = PictureView()
        self._notices = Notices(self.picture)
        self._bars, self._gauges = TouchBars(), Gauges()
        self._is_stale = True
        self._overview_due_s = 0.0
        self._timer = QTimer(self)
        self._timer.timeout.connect(self._tick)
        self._timer.start(tick_ms)

    def _take_side(self, side: SessionSide) -> None:
        """Have a side's overview drawn whenever something in it changes."""
        side.overview.changed.connect(self._on_overview_changed)
        side.overview.drawn.connect(self._on_overview_drawn)

    @Slot()
    def _tick(self) -> None:
        """Bring up to date what need not change with every picture."""
        self._notices.refresh()
        if self._is_stale and time.monotonic() >= self._overview_due_s:
            self._draw_overview()

    @Slot()
    def _on_overview_changed(self) -> None:
        self._is_stale = True

    @Slot(float)
    def _on_overview_drawn(self, took_s: float) -> None:
        """Let the overview be drawn again as soon as its share of time allows."""

    def _draw_overview(self) -> None:
        """Have it drawn, and not again before it is."""

    def _show_view(
        self, picture: PictureView, view: FrameState, pixels: NDArray[np.uint8]
    ) -> None:
        """Show a picture ``(h, w, 3)``, with the sides of the patient round it."""
        _, right, up, forward = view.camera.frame
        picture.mark_sides(side_letters(right, up), looks_towards(forward))
        picture.show_picture(pixels)

    def _point_at(self, pointer: HazardPointer | None, signs: TouchSigns) -> None:
        """Point at the nearest hazard in the picture."""
        words, (colour, _) = tr(signs.hazard_text()), hazard_look(signs, OVER)
        self.picture.point_at(pointer, words, colour)

    def catch_up(self) -> None:
        """Draw the overview now."""
        self._draw_overview()
        if self._side is not None:
            self._side.overview.finish()

    def release(self) -> list[Thread]:
        """Free the overview's graphics memory."""
        self._timer.stop()
        if self._side is not None:
            self._side.overview.release()
        return []
