"""The tour of a flight's page: what it shows, and which keys there are."""

from PySide6.QtWidgets import QWidget

from app.window.panels.endoscope_panel import PictureView
from app.window.panels.overview_panel import OverviewView
from app.window.panels.task_panel import TaskPanel
from app.window.tour import TourStop


def flight_stops(page: QWidget) -> list[TourStop]:
    """Return the cards for a flight's page, of the parts that it has."""
    found = [
        (
            page.findChild(PictureView),
            "What the scope sees",
            "Drag on the picture to tilt the scope about the nostril; W and S, or the "
            "wheel, move it in and out.",
        ),
        (
            page.findChild(TaskPanel),
            "What to do now",
            "The open tasks, and how far they are. I shows a hint; P freezes "
            "the clock.",
        ),
        (
            page.findChild(OverviewView),
            "Where you are",
            "The head from outside, with the scope in it. C opens the head.",
        ),
    ]
    keys = TourStop(
        None,
        "Keys",
        "F1 or ? shows all keys. Space keeps a moment; Q ends the flight and shows "
        "what it was worth.",
    )
    stops = [TourStop(part, title, text) for part, title, text in found if part]
    return [*stops, keys]
