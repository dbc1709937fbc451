"""What the window says: words and figures of one moment."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from paravol.scoring.readings import FREE_MM, NEAR_MM, UNKNOWN, Readings, tool_text
from scenarios import InstrumentState
from scenarios.instrument_state import EMPTY_HAND


@given(st.floats(-20.0, FREE_MM))
def test_the_word_contact_says_that_the_gap_is_negative(gap_mm: float) -> None:
    readings = Readings(clearance_mm=gap_mm)
    text = readings.texts()["Clearance"]
    assert text.startswith("contact") == (gap_mm < 0.0) == readings.is_contact
    assert readings.is_alarming == (gap_mm < NEAR_MM)
    figure = float(text.removeprefix("contact").removesuffix("mm"))
    assert figure == pytest.approx(abs(gap_mm), abs=0.0501)


@given(st.floats(-20.0, FREE_MM))
def test_a_touch_is_no_pressure(gap_mm: float) -> None:
    readings = Readings(clearance_mm=gap_mm)
    assert readings.is_pressing == (gap_mm < -0.3)
    assert readings.is_contact or not readings.is_pressing


def test_a_scope_outside_the_head_is_free() -> None:
    readings = Readings(clearance_mm=998.6)
    assert readings.texts()["Clearance"] == "free"
    assert not readings.is_alarming


def test_what_is_not_known_is_not_invented() -> None:
    assert set(Readings().texts().values()) == {UNKNOWN}
    assert not Readings().is_alarming
    assert not Readings().is_contact
    assert not Readings().is_pressing


@given(st.floats(0.0, 5999.0))
def test_the_clock_tells_whole_tenths_that_have_passed(time_s: float) -> None:
    minutes, _, seconds = Readings(time_s=time_s).texts()["Time"].partition(":")
    told_s = 60 * int(minutes) + float(seconds)
    assert float(seconds) < 60.0
    assert told_s - 1e-6 <= time_s < told_s + 0.1 + 1e-6


def test_figures_carry_their_units() -> None:
    texts = Readings(31.4, 12.6, 1.24, 75.0, 0.234, ("orbit", 3.21)).texts()
    assert texts == {
        "Frame rate": "31 fps",
        "Pose age": "13 ms",
        "Clearance": "1.2 mm",
        "Hazard": "orbit 3.2 mm",
        "Nostril": UNKNOWN,
        "Time": "1:15.0",
        "Registration": "0.23 mm",
    }
    both = Readings(drags_mm={"scope": 4.0, "tool": 2.0}).texts()["Nostril"]
    assert both == "1.2 + 0.6 N"


def test_a_head_without_labels_says_that_its_hazards_are_unknown() -> None:
    assert Readings(has_hazards=False).texts()["Hazard"] == "unknown (no labels)"
    assert Readings(hazard=("orbit", 24.9)).texts()["Hazard"] == "far"


@pytest.mark.parametrize(
    ("state", "text"),
    [
        (EMPTY_HAND, "no tool"),
        (InstrumentState("backbiter", jaw=0.0), "backbiter · jaws open"),
        (InstrumentState("backbiter", jaw=0.5), "backbiter · jaws half open"),
        (InstrumentState("backbiter", jaw=1.0), "backbiter · jaws closed"),
        (InstrumentState("curette", is_working=True), "curette · working"),
        (
            InstrumentState("microdebrider", is_working=True, is_sucking=True),
            "microdebrider · working · suction on",
        ),
    ],
)
def test_the_tool_in_hand_and_what_it_does(state: InstrumentState, text: str) -> None:
    assert tool_text(state) == text
