"""The time line: a place is a time, a time a place, and marks can be pressed."""

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from PySide6.QtCore import QPointF, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication

from app.window.replay.time_line import TimeLine, clock_text
from paravol.sessions.time_marks import MarkKind, TimeMark


@pytest.fixture
def line(application: QApplication) -> TimeLine:
    made = TimeLine()
    made.resize(640, made.height())
    made.show_session(2.0, 62.0)
    return made


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.floats(2.0, 62.0))
def test_a_time_is_found_where_it_is_painted(line: TimeLine, time_s: float) -> None:
    assert line.time_at(line.x_of(time_s)) == pytest.approx(time_s)
    assert line.time_at(-5.0) == 2.0
    assert line.time_at(9999.0) == 62.0


def test_a_mark_is_pressed_in_its_own_lane(line: TimeLine) -> None:
    injury = TimeMark.at(MarkKind.INJURY, 30.0, "Injury")
    line.show_marks([injury, TimeMark(MarkKind.NEAR, 45.0, 40.0, 50.0, "Near")])
    sought: list[float] = []
    line.sought.connect(sought.append)
    high = line.height() / (len(MarkKind) + 1.5)
    lane = 1.4 * high
    at = QPointF(line.x_of(30.0) + 2.0, lane)
    assert line.mark_at(at) is injury
    assert line.mark_at(QPointF(line.x_of(33.0), lane)) is None
    QTest.mouseClick(line, Qt.MouseButton.LeftButton, pos=at.toPoint())
    assert sought == [30.0]
    # a span is met anywhere along it
    near = line.mark_at(QPointF(line.x_of(41.0), 2.4 * high))
    assert near is not None
    assert near.text == "Near"


def test_times_are_told_as_minutes_and_seconds() -> None:
    assert clock_text(59.96) == "1:00.0"
    assert clock_text(125.0, 5.0) == "2:05"
