"""Notices: a stage is never hidden by one, and none is lost to a stage or question."""

from collections.abc import Iterator

import pytest
from PySide6.QtWidgets import QApplication

from app.window.panels import notices
from app.window.panels.endoscope_panel import PictureView
from app.window.panels.notices import Notices
from tests.app.window.desk_run import delete


@pytest.fixture
def picture(application: QApplication) -> Iterator[PictureView]:
    picture = PictureView()
    yield picture
    delete(picture)


def test_a_notice_waits_while_a_stage_is_told(
    picture: PictureView, monkeypatch: pytest.MonkeyPatch
) -> None:
    now_s = 100.0
    monkeypatch.setattr("time.monotonic", lambda: now_s)
    told = Notices(picture)
    told.say("Making the head", "", 0.2)
    told.notify("No sound", "There is no player.")
    told.say("Making the head", "", 0.4)
    told.refresh()
    assert picture._message == "Making the head"
    told.say("")
    told.notify("Ready", "Fly.")
    told.refresh()
    assert picture._message == "Ready"
    now_s += notices.NOTICE_S
    told.refresh()
    assert (picture._message, picture._detail) == ("No sound", "There is no player.")
    now_s += notices.NOTICE_S
    told.refresh()
    assert picture._message == ""


def test_a_notice_waits_for_the_answer_to_a_question(
    picture: PictureView, monkeypatch: pytest.MonkeyPatch
) -> None:
    now_s = 100.0
    monkeypatch.setattr("time.monotonic", lambda: now_s)
    told = Notices(picture)
    told.ask("End?", "Enter ends")
    told.notify("Injury", "of bone")
    now_s += 60.0
    told.refresh()
    assert picture._message == "End?"
    told.answered()
    told.refresh()
    assert picture._message == "Injury"


def test_what_takes_long_is_told_with_its_seconds(
    picture: PictureView, monkeypatch: pytest.MonkeyPatch
) -> None:
    now_s = 100.0
    monkeypatch.setattr("time.monotonic", lambda: now_s)
    told = Notices(picture)
    told.say("Preparing", "Wait.", 0.0)
    told.refresh()
    assert picture._message == "Preparing"
    now_s += 12.4
    told.refresh()
    assert picture._message == "Preparing · 12 s"
    told.say("Preparing", "Wait.", 0.5)
    assert picture._message == "Preparing · 12 s"
    assert picture._share == 0.5
    told.say("Opening", "", 0.0)
    assert picture._message == "Opening"
