"""A trainee's way through the real window by clicks and keys, and its pictures.

`tests/app/test_window.py` runs it in a process of its own, with pytest-qt. What is told
by the environment: JOURNEY_PICTURES, a folder for all pictures as they were seen;
JOURNEY_RENEW, write the reference pictures instead of comparing with them.
"""

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import pytest
from PySide6.QtCore import QMimeData, QPoint, QPointF, QRect, QSize, Qt, QUrl
from PySide6.QtGui import QColor, QDragEnterEvent, QDropEvent, QImage, QPainter
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QLabel, QWidget

from app.window.connection.connection_page import ConnectionPage
from app.window.flight.flight_page import FlightPage
from app.window.home.home_page import HomePage
from app.window.keyboard.actions import Act
from app.window.main_window import MainWindow
from app.window.navigator import Navigator, NavigatorOrder
from app.window.page import Page
from app.window.panels.endoscope_panel import PictureView
from app.window.panels.gauges import Gauges
from app.window.panels.moments import MomentView
from app.window.panels.overview_panel import OverviewView
from app.window.panels.slices_panel import SlicesView
from app.window.panels.touch_bars import TouchBars
from app.window.replay.replay_page import ReplayPage
from app.window.result.result_page import ResultPage
from app.window.settings_dialog import SettingsDialog
from app.window.tour import Tour
from app.window.volume.volume_page import VolumePage
from app.window.volume.volume_picture import VolumePicture
from paravol.exercises.training_setup import DeviceSetup, TrainingSetup
from paravol.progress.store import ProgressStore
from paravol.sessions.session_store import SessionStore
from scenarios.bundle import read_recording

Key, Left = Qt.Key, Qt.MouseButton.LeftButton
SIZES = (1280, 720), (1920, 1080), (3840, 2160)
REFERENCES = Path(__file__).parent / "pictures"
WIDTH, BLOCK = 320, 8
TOLERANCE = 15.0
"""Levels of 255, of the mean over a block of 8 x 8 of the small picture's pixels.

On one machine two runs differ by 0.0. Letters drawn without smooth edges, or with full
hinting, make 4.5, a serif font 6; a font of another width 24 to 37: where DejaVu Sans
is not there, the pictures are to be renewed.
"""

LIMIT_MS = 240_000
"""Kernels that are in no cache yet are compiled meanwhile."""

LIVE = (
    *(PictureView, OverviewView, SlicesView, MomentView, VolumePicture),
    *(Gauges, TouchBars),
)
"""What never looks twice the same: it is painted out before pictures are compared."""

_P = TypeVar("_P", bound=Page)


class Journey:
    """Drive one window; every step waits for what the last one brought."""

    def __init__(self, qtbot: Any, folder: Path, size: int) -> None:
        """Open the window at its home page, with nothing flown before."""
        self.bot = qtbot
        self.folder = folder
        setup = TrainingSetup(
            devices=DeviceSetup(),
            size=size,
            threads=2,
            sessions=SessionStore(folder / "sessions"),
        )
        order = NavigatorOrder(
            setup,
            store=folder / "progress.sqlite",
            choices=folder / "trainee.json",
        )
        self.window = MainWindow()
        self.desk = Navigator(self.window, order)
        qtbot.addWidget(self.window)
        self.resize(SIZES[0])
        self.window.show()
        self.desk.open_home()

    def until(self, holds: Callable[[], object]) -> None:
        """Let events come in until something holds."""
        self.bot.waitUntil(lambda: bool(holds()), timeout=LIMIT_MS)

    def shown(self, kind: type[_P]) -> _P:
        """Wait for a page."""
        self.until(lambda: isinstance(self.window.page, kind))
        page = self.window.page
        assert isinstance(page, kind)
        return page

    def press(self, key: Qt.Key, *modifiers: Qt.KeyboardModifier) -> None:
        """Press a key where the keyboard is."""
        page = self.window.page
        mask = Qt.KeyboardModifier.NoModifier
        for modifier in modifiers:
            mask |= modifier
        QTest.keyClick(page.focusWidget() or page, key, mask)

    def click(self, part: QWidget) -> None:
        """Click on the middle of a part that can be seen."""
        assert part.isVisible()
        assert part.isEnabled()
        QTest.mouseClick(part, Left, pos=part.rect().center())

    def resize(self, size: tuple[int, int]) -> None:
        """Give the window a size, as somebody does who drags its edge."""
        self.window.resize(*size)
        self.until(lambda: self.window.size() == QSize(*size))

    def seen(
        self, name: str, *hidden: QWidget, sizes: tuple[tuple[int, int], ...] = SIZES
    ) -> None:
        """Compare the window with its pictures at some sizes.

        hidden: parts whose figures or dates are others each time.
        """
        for size in sizes:
            self.resize(size)
            self.bot.wait(400)
            self.window.page.catch_up()
            shot = self.window.grab().toImage()
            place = f"{name}-{size[0]}.png"
            if kept := os.environ.get("JOURNEY_PICTURES"):
                shot.save(str(Path(kept) / place))
            parts = [p for kind in LIVE for p in self.window.findChildren(kind)]
            small = masked(shot, self.window, [*parts, *hidden])
            if os.environ.get("JOURNEY_RENEW"):
                REFERENCES.mkdir(exist_ok=True)
                small.save(str(REFERENCES / place))
            reference = QImage(str(REFERENCES / place))
            assert not reference.isNull(), place
            off = difference(small, reference)
            print(f"{place}: off by {off:.1f}")
            assert off <= TOLERANCE, (place, off)
        self.resize(SIZES[0])

    def see_tour(self) -> int:
        """Go through the tour that covers the page by Enter; count its cards."""
        page, count = self.window.page, 0
        self.until(lambda: page.findChild(Tour) is not None)
        while (tour := page.findChild(Tour)) is not None and not tour.isHidden():
            QTest.keyClick(tour, Key.Key_Return)
            count += 1
            assert count < 8
            self.bot.wait(20)
        return count

    def drop(self, *paths: Path) -> None:
        """Drop folders on the window."""
        data = QMimeData()
        data.setUrls([QUrl.fromLocalFile(str(path)) for path in paths])
        none, copy = Qt.KeyboardModifier.NoModifier, Qt.DropAction.CopyAction
        entered = QDragEnterEvent(QPoint(99, 99), copy, data, Left, none)
        QApplication.sendEvent(self.window, entered)
        assert entered.isAccepted()
        dropped = QDropEvent(QPointF(99, 99), copy, data, Left, none)
        QApplication.sendEvent(self.window, dropped)

    def close(self) -> None:
        """Close the window by its keys, and end all."""
        self.press(Key.Key_Q, Qt.KeyboardModifier.ControlModifier)
        self.until(lambda: not self.window.isVisible())
        self.desk.close()
        self.window.release()
        self.until(lambda: not self.desk._works)


def masked(shot: QImage, window: QWidget, parts: list[QWidget]) -> QImage:
    """Return a window's picture, small and grey, with its visible parts painted out."""
    painter = QPainter(shot)
    for part in parts:
        if part.isVisible():
            corner = part.mapTo(window, QPoint(0, 0))
            painter.fillRect(QRect(corner, part.size()), QColor("gray"))
    painter.end()
    smooth = Qt.TransformationMode.SmoothTransformation
    small = shot.scaledToWidth(WIDTH, smooth)
    return small.convertToFormat(QImage.Format.Format_Grayscale8)


def levels(image: QImage) -> np.ndarray:
    """Return a picture's grey levels (rows, columns), whole blocks of them."""
    grey = image.convertToFormat(QImage.Format.Format_Grayscale8)
    high, wide, step = grey.height(), grey.width(), grey.bytesPerLine()
    rows = np.frombuffer(grey.constBits(), np.uint8).reshape(high, step)
    return rows[: high // BLOCK * BLOCK, : wide // BLOCK * BLOCK].astype(float)


def difference(one: QImage, other: QImage) -> float:
    """Return the largest difference of the mean of a block; 255 for other sizes."""
    if one.size() != other.size():
        return 255.0
    off = levels(one) - levels(other)
    high, wide = off.shape
    blocks = off.reshape(high // BLOCK, BLOCK, wide // BLOCK, BLOCK).mean((1, 3))
    return float(np.abs(blocks).max())


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    return tmp_path


def begin(way: Journey) -> HomePage:
    """See the tour of the home page."""
    page = way.shown(HomePage)
    way.until(lambda: page.go_on.text())
    way.until(lambda: way.desk._has_found)
    assert way.see_tour() == 5
    # it took the keyboard, and gave it back
    assert page.focusWidget() is page.go_on
    return page


def fly_in(way: Journey) -> FlightPage:
    """Wait for a flight's picture and move the scope in by keys."""
    page = way.shown(FlightPage)
    way.until(lambda: page._frame is not None)
    if "flight" not in way.desk._choices.tours:
        assert way.see_tour() >= 3
    before = page._frame
    assert before is not None
    QTest.keyPress(page, Key.Key_W)
    way.until(lambda: moved_mm(page, before) > 3.0)
    QTest.keyRelease(page, Key.Key_W)
    return page


def moved_mm(page: FlightPage, before: Any) -> float:
    """Return how far the tip is from where it was."""
    assert page._frame is not None
    here, there = page._frame.view.world_from_tip, before.view.world_from_tip
    return float(np.abs(here[:3, 3] - there[:3, 3]).max())


def end_flight(way: Journey, page: FlightPage) -> ResultPage:
    """End a flight by its keys; wait for the score."""
    way.press(Key.Key_Q)
    assert way.window.page is page  # it asks
    way.press(Key.Key_Return)
    result = way.shown(ResultPage)
    way.until(lambda: result.parts.isVisible())
    assert result.problem.text() == ""
    return result


def unlike(page: ResultPage) -> list[QWidget]:
    """Return what tells times, places and how one flew on a page of results."""
    return [page._left, page._figures, page._kept, page.handling]


def test_short_way(qtbot: Any, folder: Path) -> None:
    way = Journey(qtbot, folder, size=64)
    page = begin(way)
    way.seen("home", page.bar.device, sizes=SIZES[:1])
    way.press(Key.Key_Return)
    flight = fly_in(way)
    result = end_flight(way, flight)
    assert result.verdict.text() == "Not passed yet"
    way.press(Key.Key_H)
    page = way.shown(HomePage)
    way.until(lambda: page.list.current is not None and page.isVisible())
    way.close()
    assert [flown.is_kept for flown in way.desk.flown] == [True]


def test_whole_way(qtbot: Any, folder: Path) -> None:
    way = Journey(qtbot, folder, size=512)
    home = begin(way)
    way.seen("home", home.bar.device)
    choose_theme(way, home)
    look_at_a_scan(way)
    look_at_an_arm(way)
    fly_by_the_list(way)
    result = end_flight(way, do_all_in_flight(way))
    way.seen("result", *unlike(result))
    assert result.points.text() == "0 of 8 tasks"
    assert result.following.text() == "Next: Hoops (N)"
    way.press(Key.Key_A)
    flight = fly_in(way)
    result = end_flight(way, flight)
    replay(way)
    home = way.shown(HomePage)
    way.until(lambda: home.go_on.text() == "Continue: Centring")
    current = home.list.current
    assert current is not None
    assert current.exercise is not None
    assert len(current.exercise.attempts) == 2
    assert home.findChild(Tour) is None
    way.seen("home-again", home.bar.device, home.card)
    way.close()
    assert [flown.is_kept for flown in way.desk.flown] == [True, True]
    assert way.desk.error is None
    for flown in way.desk.flown:
        assert flown.end is not None
        assert flown.end.record is not None
        assert (flown.end.record / "result.json").is_file()
    assert len(ProgressStore(folder / "progress.sqlite").sessions()) == 2


def choose_theme(way: Journey, home: HomePage) -> None:
    """Choose another theme in the settings, then the first one again."""
    for key, name in ((Key.Key_Down, "light"), (Key.Key_Up, "dark")):
        way.click(home.bar.settings)
        way.until(lambda: way.window.findChild(SettingsDialog) is not None)
        dialog = way.window.findChild(SettingsDialog)
        assert dialog is not None
        QTest.keyClick(dialog.theme, key)
        if name == "light":
            kept = os.environ.get("JOURNEY_PICTURES")
            if kept:
                dialog.grab().save(str(Path(kept) / "settings.png"))
        QTest.keyClick(dialog, Key.Key_Return)
        way.until(lambda: way.window.findChild(SettingsDialog) is None)
        assert way.window._preferences.theme == name
        # a desktop does this; here there is none
        way.window.activateWindow()
        way.until(way.window.isActiveWindow)
        if name == "light":
            way.seen("home-light", home.bar.device)


def look_at_a_scan(way: Journey) -> None:
    """Find an exercise with a head by keys, see its scan, and go back."""
    home = way.shown(HomePage)
    home.list.setFocus()
    for _ in range(40):
        if home.card.scan.isVisible():
            break
        way.press(Key.Key_Down)
    assert not home.card.start.isEnabled()  # it is locked
    way.seen("locked", home.bar.device)
    way.click(home.card.scan)
    page = way.shown(VolumePage)
    way.until(lambda: "splats" in page.picture._said)
    way.seen("volume")
    way.press(Key.Key_Escape)
    way.until(lambda: way.shown(HomePage).list.current is not None)


def look_at_an_arm(way: Journey) -> None:
    """See the emulated arm's counts, and go back."""
    home = way.shown(HomePage)
    way.click(home.bar.connection)
    page = way.shown(ConnectionPage)
    page.chooser.setCurrentIndex(page.chooser.count() - 1)
    way.until(lambda: "mm" in page.figures["Tip"].text())
    way.seen("connection", *page.figures.values(), page.chooser)
    way.press(Key.Key_Escape)


def fly_by_the_list(way: Journey) -> None:
    """Choose the first exercise in the list by keys, and start it."""
    home = way.shown(HomePage)
    way.until(lambda: home.list.current is not None)
    home.list.setFocus()
    for key in (Key.Key_Down, Key.Key_Down, Key.Key_Up, Key.Key_Up):
        way.press(key)
    current = home.list.current
    assert current is not None
    assert current.exercise is not None
    assert current.exercise.name == "centring"
    way.press(Key.Key_Return)


def do_all_in_flight(way: Journey) -> FlightPage:
    """Fly by keys and mouse; use what the page offers; return it for its end."""
    page = fly_in(way)
    before = page._frame
    middle = page.picture.rect().center()
    QTest.mousePress(page.picture, Left, pos=middle)
    for step in range(1, 9):
        QTest.mouseMove(page.picture, middle + QPoint(6 * step, 2 * step), 20)
    QTest.mouseRelease(page.picture, Left, pos=middle)
    way.until(lambda: moved_mm(page, before) > 0.2)
    way.press(Key.Key_I)
    way.until(lambda: page._side.tasks.has_hint)
    freeze = page._actions.bar.button(Act.FREEZE)
    assert freeze is not None
    way.click(freeze)
    way.until(lambda: page._frame is not None and page._frame.is_frozen)
    way.seen("frozen", *labels_with_figures(page))
    way.click(freeze)
    way.until(lambda: page._frame is not None and not page._frame.is_frozen)
    angle_deg = scope_deg(page)
    way.press(Key.Key_O)
    way.until(lambda: scope_deg(page) != angle_deg)
    way.press(Key.Key_Space)
    way.until(lambda: page._moments.times_s)
    if kept := os.environ.get("JOURNEY_PICTURES"):
        way.bot.wait(8000)
        way.window.page.catch_up()
        way.window.grab().save(str(Path(kept) / "flight-1280.png"))
    way.press(Key.Key_F1)
    way.until(lambda: not page._help.isHidden())
    way.seen("keys", *labels_with_figures(page))
    way.press(Key.Key_Escape)
    assert page._help.isHidden()
    return page


def scope_deg(page: FlightPage) -> float:
    """Return the angle of the scope that is put in."""
    assert page._frame is not None
    return page._frame.view.scope_deg


def labels_with_figures(page: FlightPage) -> list[QLabel]:
    """Return what tells times on a flight's page."""
    return [page._side._info]


def replay(way: Journey) -> None:
    """See the flight again, then both side by side, and go home."""
    way.press(Key.Key_R)
    page = way.shown(ReplayPage)
    way.until(lambda: settled(page))
    assert page._opened is not None
    times = page._opened.frame_times_s
    at = QPointF(page.line.x_of(times[len(times) // 2]), page.line.height() - 2.0)
    QTest.mouseClick(page.line, Left, pos=at.toPoint())
    way.until(lambda: settled(page))
    assert page._seen is not None
    assert page._seen.here.sample.time_s > times[0]
    ends = [flown.end for flown in way.desk.flown]
    sessions = [end.record for end in ends if end is not None and end.record]
    assert len(set(sessions)) == 2
    assert all(read_recording(session).info for session in sessions)
    way.seen("replay", *changing(page))
    way.press(Key.Key_Q)
    home = way.shown(HomePage)
    way.until(lambda: home.bar.recordings.isVisible())
    way.click(home.bar.recordings)
    page = way.shown(ReplayPage)
    way.until(lambda: page.welcome.recent.count() == 2)
    way.seen("replay-empty", page.welcome.recent)
    way.drop(*sessions)
    way.until(lambda: settled(page) and page.beside.isVisible())
    way.press(Key.Key_Right)
    way.until(lambda: settled(page))
    way.seen("compared", *changing(page))
    way.press(Key.Key_Q)


def changing(page: ReplayPage) -> list[QWidget]:
    """Return what tells times and names on a page of replays."""
    assert page._side is not None
    # how wide the transport's texts are depends on the frame that is shown
    fixed = [page.line, page._side.events, page.transport]
    return [*fixed, *page.findChildren(QLabel)]


def settled(page: ReplayPage) -> bool:
    """Return whether the moment that was wished for is shown."""
    return (
        page._opened is not None
        and page._seen is not None
        and page._seen.jump == page._jump
    )
