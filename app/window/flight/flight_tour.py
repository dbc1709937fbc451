"""The tour of a flight's page: what it shows, and which keys there are."""

from PySide6.QtWidgets import QWidget

from app.window.keyboard.actions import Act
from app.window.keyboard.key_map import KEYS
from app.window.panels.endoscope_panel import PictureView
from app.window.panels.overview_panel import OverviewView
from app.window.panels.task_panel import TaskPanel
from app.window.texts import tr
from app.window.tour import TourStop


def flight_stops(page: QWidget, *, has_tools: bool) -> list[TourStop]:
    """Return the cards for a flight's page, of the parts that it has.

    has_tools: the second hand is the window's.
    """
    key = KEYS.label
    found = [
        (
            page.findChild(PictureView),
            tr("What the scope sees"),
            tr(
                "Drag on the picture to tilt the scope about the nostril; "
                "{move_in} and {move_out}, or the wheel, move it in and "
                "out.",
                move_in=key(Act.MOVE_IN),
                move_out=key(Act.MOVE_OUT),
            ),
        ),
        (
            page.findChild(TaskPanel),
            tr("What to do now"),
            tr(
                "The open tasks, and how far they are. {hint} shows a "
                "hint; {freeze} freezes the clock.",
                hint=key(Act.HINT),
                freeze=key(Act.FREEZE),
            ),
        ),
        (
            page.findChild(OverviewView),
            tr("Where you are"),
            tr(
                "The head from outside, with the scope in it. {open_head} "
                "opens the head.",
                open_head=key(Act.OPEN_HEAD),
            ),
        ),
    ]
    tools = TourStop(
        page.findChild(PictureView),
        tr("Two hands"),
        tr(
            "{tool} takes a tool. Its tip goes to where the mouse points, and the "
            "wheel moves it deeper; the button that tilts the scope bites or cuts. "
            "Keys go on moving the scope, as does the other button. Keep the scope "
            "above, the tool below: what lies in the lower half of the picture is "
            "reached best. {hold} gives the mouse to the scope, and back. With "
            "{assist} an assistant lays the scope where the tool gets to its place.",
            tool=key(Act.NEXT_TOOL),
            hold=key(Act.HOLD),
            assist=key(Act.ASSIST),
        ),
    )
    keys = TourStop(
        None,
        tr("Keys"),
        tr(
            "{help} or ? shows all keys. {moment} keeps a moment; "
            "{end} ends the flight and shows what it was worth.",
            help=key(Act.HELP),
            moment=key(Act.MOMENT),
            end=key(Act.END),
        ),
    )
    stops = [TourStop(part, title, text) for part, title, text in found if part]
    return [*stops, *((tools,) if has_tools else ()), keys]
