"""The page of a flight, laid out at many sizes; no flight is flown."""

import itertools
import subprocess
import sys
from collections.abc import Iterator
from types import SimpleNamespace
from typing import cast
from unittest.mock import patch

import numpy as np
import pytest

pytest.importorskip(
    "PySide6.QtWidgets", reason="the extra 'desktop'", exc_type=ImportError
)

from PySide6.QtCore import QPoint, QRect, QSize, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QLabel, QMainWindow, QWidget

from app.window.flight.flight_page import FlightPage
from app.window.flight.flight_thread import DisplayedFrame, FlightThread, ScopeLaid
from app.window.keyboard.actions import Act
from app.window.style import style_sheet
from app.window.window_size import scale_for
from paravol.flight.flight import FlightOrder
from paravol.guide import GuideMark
from paravol.inputs import choose_input
from paravol.scoring.readings import Readings
from scenarios import InstrumentState, Scenario
from scenarios.instrument_state import NO_TOOL
from scenarios.tasks import Status, TaskState
from scenarios.tasks.task import Reach
from tests.app.window.opened_window import ROOT

SIZES = (1280, 720), (1920, 1080), (3840, 2160)
FACTORS = 1.0, 1.5, 2.0

TASKS = tuple(
    Reach(
        name=name,
        title="Bring the tip of the scope to the natural ostium of the maxillary sinus",
        place=(0, 0, 0),
        radius_mm=1.0,
        hint="Follow the free edge of the uncinate process downwards and backwards, "
        "until the fontanelle is seen; the ostium lies behind it, not in it.",
    )
    for name in ("one", "two")
)
SCENARIO = Scenario(
    "long", "Uncinectomy and middle meatal antrostomy of the left side", tasks=TASKS
)
READINGS = Readings(
    120.4, 104.6, -12.3, 3599.9, 10.25, drags_mm={"scope": 12.0, "tool": 11.0}
)


def opened() -> FlightPage:
    chosen = choose_input("mouse", None, SCENARIO, None, None)
    order = FlightOrder(SCENARIO, None, chosen, 2048, 1, None, follows_window=True)
    return FlightPage(FlightThread(order), edge_samples=0)


@pytest.fixture(scope="module")
def page(application: QApplication) -> Iterator[FlightPage]:
    window, page = QMainWindow(), opened()
    window.setCentralWidget(page)
    window.setMinimumSize(1, 1)
    window.show()
    fill(page)
    yield page
    page.release()
    window.close()


def fill(page: FlightPage) -> None:
    """Show long texts wherever there are texts."""
    page._timer.stop()
    states = [TaskState(task.name, Status.OPEN, 0.5) for task in TASKS]
    page._side.tasks.show_states(states)
    page._side.tasks.switch_hint()
    assert TASKS[0].hint in page._side.tasks.hint
    place = "sphenoethmoidal recess, right, unseen"
    way = GuideMark(place, np.zeros(3), 123.0, 0.5, 0.5, is_goal=True)
    page._side.tasks.show_way(way, is_on=True)
    page._side.show_tool(InstrumentState("microdebrider", is_sucking=True))
    page._gauges.show_readings(READINGS)
    picture = "picture 768 of 1024 px: frames were late"
    page._gauges.show_status(READINGS.status(is_recording=False, picture=picture))
    page._side._info.setText(
        "CT soft tissue 350/40 · sagittal: R 112.3 · A 101.2 · I 103.4 mm · -1000 HU"
    )


def leaves(page: QWidget) -> list[QWidget]:
    """Return what is seen of a page: every visible part that holds no others."""
    parts = [part for part in page.findChildren(QWidget) if part.isVisible()]
    parents = {id(part.parentWidget()) for part in parts}
    return [part for part in parts if id(part) not in parents]


def place_of(part: QWidget, page: QWidget) -> QRect:
    return QRect(part.mapTo(page, QPoint()), part.size())


def faults(page: QWidget) -> list[str]:
    """Return what is cut off, lies outside or over something else."""
    found = []
    parts = leaves(page)
    for part in parts:
        name = part.text() if isinstance(part, QLabel) else type(part).__name__
        if not page.rect().contains(place_of(part, page)):
            found.append(f"{name} outside: {place_of(part, page)}")
        if not isinstance(part, QLabel):
            continue
        if part.wordWrap():
            if part.heightForWidth(part.width()) > part.height():
                found.append(f"{name} cut off: {part.size()}")
        elif not QRect(QPoint(), part.size()).contains(
            QRect(QPoint(), part.sizeHint())
        ):
            found.append(f"{name} cut off: {part.size()} of {part.sizeHint()}")
    for one, other in itertools.combinations(parts, 2):
        if place_of(one, page).intersects(place_of(other, page)):
            found.append(f"{one} over {other}")
    return found


def lay_out(
    page: FlightPage, size: tuple[int, int], factor: float, font_scale: float = 1.0
) -> None:
    """Give the page a size in a screen's pixels, of which Qt's are a factor larger."""
    window = page.window()
    logical = QSize(round(size[0] / factor), round(size[1] / factor))
    scale = font_scale * scale_for(logical, factor)
    window.setStyleSheet(style_sheet(scale))
    page.set_scale(scale)
    window.resize(logical)
    QApplication.processEvents()
    QApplication.processEvents()
    assert page.size() == logical


@pytest.mark.parametrize("factor", FACTORS)
@pytest.mark.parametrize("size", SIZES)
def test_nothing_is_cut_off_or_lies_over_another_at_any_size(
    page: FlightPage, size: tuple[int, int], factor: float
) -> None:
    for _ in range(3):
        lay_out(page, size, factor)
        assert faults(page) == [], page._large.name
        page._large.next()


SCALED = """
import os, sys
os.environ["QT_SCALE_FACTOR"] = sys.argv[1]
os.environ["QT_QPA_PLATFORM"] = "offscreen"
from PySide6.QtWidgets import QApplication
from app.window.main_window import MainWindow
from tests.app.window.flight.test_flight_page import SIZES, faults, fill, opened

application = QApplication([])
window, page = MainWindow(), opened()
assert window.devicePixelRatioF() == float(sys.argv[1])
window.show_page(page)
window.show()
fill(page)
for width, height in SIZES:
    factor = window.devicePixelRatioF()
    window.resize(round(width / factor), round(height / factor))
    for _ in range(2):
        application.processEvents()
    assert page.grab().size().width() == width, page.size()
    assert faults(page) == [], faults(page)
    if len(sys.argv) > 2:
        page.grab().save(f"{sys.argv[2]}/{width}x{factor:g}.png")
page.release()
print("done")
"""


@pytest.mark.slow
@pytest.mark.parametrize("factor", FACTORS)
def test_qts_own_scaling_leaves_room_for_everything(factor: float) -> None:
    done = subprocess.run(
        [sys.executable, "-c", SCALED, f"{factor:g}"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=120.0,
    )
    assert (done.returncode, done.stdout) == (0, "done\n"), done.stderr


@pytest.mark.parametrize("size", [*SIZES, (1024, 768)])
@pytest.mark.parametrize("font_scale", [0.8, 1.3])
def test_smaller_and_larger_texts_fit_too(
    page: FlightPage, size: tuple[int, int], font_scale: float
) -> None:
    lay_out(page, size, 1.0, font_scale)
    assert faults(page) == []


@pytest.mark.parametrize("size", SIZES)
def test_the_help_has_room_for_all_keys(
    page: FlightPage, size: tuple[int, int]
) -> None:
    lay_out(page, size, 1.0)
    QTest.keyClick(page, Qt.Key.Key_F1)
    assert page._help.isVisible()
    assert faults(page._help) == []
    assert page.rect().contains(page._help.geometry())
    QTest.keyClick(page, Qt.Key.Key_Escape)
    assert page._help.isHidden()
    QTest.keyClick(page, Qt.Key.Key_Question)
    QTest.mouseClick(page._help, Qt.MouseButton.LeftButton)
    assert page._help.isHidden()


@pytest.mark.parametrize("size", SIZES)
def test_a_long_message_takes_more_lines_within_the_picture(
    page: FlightPage, size: tuple[int, int]
) -> None:
    lay_out(page, size, 1.0)
    room, scale = page.picture.rect(), scale_for(QSize(*size))
    page.picture.say("Ready", "Fly.")
    short, *_ = page.picture.message_box(room, scale)
    page.picture.say("The scope cannot be held " * 4, "Take a tool first. " * 20)
    box, title, detail = page.picture.message_box(room, scale)
    page.picture.say("")
    assert box.height() > 2 * short.height()
    assert box.contains(title)
    assert box.contains(detail)
    assert not title.intersects(detail)
    assert room.contains(box.toAlignedRect())


def test_a_key_hides_the_way_and_shows_it_again(page: FlightPage) -> None:
    switched: list[bool] = []
    page.guide_switched.connect(switched.append)
    button = page._actions.bar.button(Act.GUIDE)
    assert button is not None
    QTest.keyClick(page, Qt.Key.Key_G)
    QTest.mouseClick(button, Qt.MouseButton.LeftButton)
    assert switched == [False, True]
    assert page._thread.guide.is_on
    assert list(page._flight._aids) == ["guide off", "guide on"]


def test_an_assistant_lays_the_scope_for_a_tool_only(page: FlightPage) -> None:
    asked: list[DisplayedFrame] = []

    def lay(frame: DisplayedFrame) -> bool:
        asked.append(frame)
        if frame.tool.name == NO_TOOL:
            return False
        page._thread.told.emit(ScopeLaid(False, "backbiter"))
        return True

    button = page._actions.bar.button(Act.ASSIST)
    assert button is not None
    said: list[tuple[str, str]] = []
    with (
        patch.object(page._thread, "lay_scope", lay),
        patch.object(page._aids, "_notify", lambda *words: said.append(words)),
    ):
        for tool in (NO_TOOL, "curette"):
            page._thread.last = cast(
                DisplayedFrame, SimpleNamespace(tool=InstrumentState(tool))
            )
            QTest.keyClick(page, Qt.Key.Key_R)
            QTest.mouseClick(button, Qt.MouseButton.LeftButton)
        page._thread.last = None
        QTest.keyClick(page, Qt.Key.Key_R)
    assert len(asked) == 4
    assert sum("backbiter" in detail for _, detail in said) == 2


def test_what_is_taken_in_the_first_frame_of_a_press_is_told(page: FlightPage) -> None:
    """A shaver takes tissue before any frame shows that it works."""
    said: list[str] = []
    with patch.object(page._notices, "notify", lambda words, _: said.append(words)):
        for is_working, mm3 in (
            (False, 4.0),
            (True, 16.0),
            (True, 16.0),
            (False, 16.0),
        ):
            state = InstrumentState("microdebrider", is_working=is_working)
            signs = SimpleNamespace(taken_mm3={"polyp": mm3})
            page._tell_taken(
                cast(DisplayedFrame, SimpleNamespace(tool=state, signs=signs))
            )
    assert len(said) == 1
    assert "12" in said[0]


def test_names_are_shown_while_their_key_is_held(page: FlightPage) -> None:
    QTest.keyPress(page, Qt.Key.Key_E)
    assert page._thread.names_at is not None
    QTest.keyRelease(page, Qt.Key.Key_E)
    assert page._thread.names_at is None


def test_views_change_places_and_come_back(page: FlightPage) -> None:
    lay_out(page, SIZES[0], 1.0)
    parts = {
        "The scope's picture": page.picture,
        "Slices": page._slices,
        "Overview": page._overview,
    }
    before = {name: part.geometry() for name, part in parts.items()}
    for name in ("Slices", "Overview", "The scope's picture"):
        QTest.keyClick(page, Qt.Key.Key_F4)
        QApplication.processEvents()
        areas = {n: p.width() * p.height() for n, p in parts.items()}
        assert max(areas, key=areas.__getitem__) == name == page._large.name
    assert {name: part.geometry() for name, part in parts.items()} == before


def test_the_picture_is_wanted_as_large_as_it_is_on_the_screen(
    page: FlightPage,
) -> None:
    sizes = page._flight.picture
    assert sizes is not None
    assert page._flight.size == 512
    for size, expected in zip(SIZES, (640, 1024, 2048), strict=True):
        lay_out(page, size, 1.0)
        page._tick()
        assert sizes._wanted == expected >= page.picture.edge_px > expected // 2
    # beside large slices it is smaller
    page._large.next()
    QApplication.processEvents()
    page._tick()
    assert sizes._wanted < 2048
    page._large.show("The scope's picture")
