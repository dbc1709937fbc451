"""A scan's page: turned, drawn in each way, its look kept."""

import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication

from app.window.main_window import MainWindow
from app.window.page import Page
from app.window.volume.volume_page import VolumePage
from paravol.volume.scan import Scan, scans_of
from paravol.volume.volume_view import Drawn, VolumeView
from renderers.scene import Volume
from tests.app.window.desk_run import delete, until, wait, waits_of_the_window

pytestmark = pytest.mark.display

Seen = tuple[NDArray[np.int64], NDArray[np.bool_]]


@pytest.fixture(scope="module")
def scans() -> list[Scan]:
    """A ball in two scans."""
    side = np.arange(32.0)
    z, y, x = np.meshgrid(side, side, side, indexing="ij")
    depth = 9.0 - np.sqrt((x - 20) ** 2 + (y - 15) ** 2 + (z - 12) ** 2)
    hu = np.clip(1300 * (0.5 + depth / 2) - 1000, -1000, 600).astype(np.float32)
    ct = Volume(hu, np.ones(3), np.zeros(3))
    mr = ct.with_values(np.where(depth > 0, 300.0, 10.0).astype(np.float32), 0.0)
    return scans_of(ct, {"t1": mr})


@pytest.fixture
def window(application: QApplication) -> Iterator[MainWindow]:
    window = MainWindow()
    yield window
    window.shut()
    window.release()
    delete(window)


def opened(window: MainWindow, scans: list[Scan]) -> tuple[VolumePage, list[Drawn]]:
    """Show a page of the scans; give it, and what will be drawn for it."""
    page, drawn = VolumePage("Ball", scans, 1), list[Drawn]()
    page.drawing.drawn.connect(drawn.append)
    page.left.connect(lambda: window.show_page(Page()))
    window.show_page(page)
    window.show()
    return page, drawn


@pytest.mark.slow
def test_a_scan_is_turned_edited_and_drawn_in_each_way(
    window: MainWindow, scans: list[Scan], tmp_path: Path
) -> None:
    page, drawn = opened(window, scans)
    controls = page.controls

    def shown(do: Callable[[], object]) -> Seen:
        """Give what is shown once nothing more comes."""
        count = len(drawn)
        do()
        until("a picture", lambda: len(drawn) > count)
        until("the last", lambda: page.drawing.is_idle)
        wait(50)
        pixels = drawn[-1].pixels.astype(np.int64)
        return pixels, pixels.sum(axis=2) > 80

    shown(lambda: controls.preset.setCurrentIndex(1))
    controls.preset.setCurrentIndex(0)
    splats, ball = shown(lambda: QTest.keyClick(page.picture, Qt.Key.Key_Right))
    rays, ball_by_rays = shown(lambda: controls.method.setCurrentIndex(2))
    assert rays.shape[:2] == splats.shape[:2]
    _, by_surface = shown(lambda: controls.method.setCurrentIndex(4))
    both = (ball_by_rays & by_surface).sum() / (ball_by_rays | by_surface).sum()
    assert both > 0.9
    # splats of a millimetre blur so small a ball, evenly
    middles = [np.argwhere(seen).mean(axis=0) for seen in (ball, ball_by_rays)]
    assert np.abs(middles[0] - middles[1]).max() < 3.0
    controls.method.setCurrentIndex(0)
    shown(lambda: QTest.keyClick(page.picture, Qt.Key.Key_Left))
    page.keep_look(tmp_path / "mine")
    page.open_look(tmp_path / "no such.json")
    assert "no such.json" in page.picture._said
    points = controls.look.points
    controls.preset.setCurrentIndex(3)
    page.open_look(tmp_path / "mine.json")
    assert controls.look.points == points
    shown(lambda: controls.scan_box.setCurrentIndex(1))
    assert controls.scan.title == "MR, T1"


def test_the_first_picture_is_rough_and_what_keeps_waiting_is_told(
    window: MainWindow, scans: list[Scan], monkeypatch: pytest.MonkeyPatch
) -> None:
    is_wanted, draw = threading.Event(), VolumeView.draw

    def slow(view: VolumeView, *words: Any) -> Drawn:
        # as on a machine that has never run the program
        is_wanted.wait(60.0)
        return draw(view, *words)

    monkeypatch.setattr(VolumeView, "draw", slow)
    page, drawn = opened(window, scans)
    until("a rough picture", lambda: drawn)
    assert drawn[0].splats is None
    assert (drawn[0].pixels.astype(int).sum(axis=2) > 120).sum() > 500
    until("a stage", lambda: "volume is being made" in page.stage.text())
    assert page.share.isVisible()
    # who leaves meanwhile need not wait for it
    monkeypatch.setattr(threading.Thread, "join", threading.Thread.join)
    waits = waits_of_the_window(lambda: None)
    QTest.keyClick(page.picture, Qt.Key.Key_Escape)
    until("another page", lambda: not isinstance(window.page, VolumePage))
    assert not waits
    page, drawn = opened(window, scans)
    is_wanted.set()
    until("the volume", lambda: drawn and drawn[-1].splats)
    until("an end", lambda: not page.share.isVisible() and page.stage.text() == "")
    QTest.keyClick(page.picture, Qt.Key.Key_Q, Qt.KeyboardModifier.ControlModifier)
    assert not window.isVisible()
