"""The tour of a flight's page: what it shows, and which keys there are."""

from PySide6.QtWidgets import QWidget

from app.window.keyboard.actions import Act
from app.window.keyboard.key_map import KEYS
from app.window.panels.endoscope_panel import PictureView
from app.window.panels.overview_panel import OverviewView
from app.window.panels.task_panel import TaskPanel
from app.window.tour import TourStop


def flight_stops(page: QWidget) -> list[TourStop]:
    """Return the cards for a flight's page, of the parts that it has."""
    key = KEYS.label
    found = [
        (
            page.findChild(PictureView),
            "What the scope sees",
            "Drag on the picture to tilt the scope about the nostril; "
            f"{key(Act.MOVE_IN)} and {key(Act.MOVE_OUT)}, or the wheel, move it in and "
            "out.",
        ),
        (
            page.findChild(TaskPanel),
            "What to do now",
            "The open tasks, and how far they are. "
            f"{key(Act.HINT)} shows a hint; {key(Act.FREEZE)} freezes the clock.",
        ),
        (
            page.findChild(OverviewView),
            "Where you are",
            "The head from outside, with the scope in it. "
            f"{key(Act.OPEN_HEAD)} opens the head.",
        ),
    ]
    keys = TourStop(
        None,
        "Keys",
        f"{key(Act.HELP)} or ? shows all keys. {key(Act.MOMENT)} keeps a moment; "
        f"{key(Act.END)} ends the flight and shows what it was worth.",
    )
    stops = [TourStop(part, title, text) for part, title, text in found if part]
    return [*stops, keys]
