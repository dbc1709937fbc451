import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.microscribe.emulator.faults.schedule import (
    Schedule,
    Trigger,
    parse_schedule,
)


def fires(text: str, *, lasts: bool, at: list[tuple[float, int]]) -> list[bool]:
    trigger = Trigger(parse_schedule(text), lasts, random.Random(0))
    return [trigger.fires(script_s, number) for script_s, number in at]


SECONDS = [(0.0, 1), (1.9, 2), (2.0, 3), (2.5, 4), (3.0, 5), (9.0, 6)]


@pytest.mark.parametrize(
    ("text", "lasts", "expected"),
    [
        ("2", False, "..x..."),
        ("2", True, "..xxxx"),
        ("2+1", False, "..xx.."),
        ("2+1", True, "..xx.."),
        ("0", False, "x....."),
        ("packet:4", False, "...x.."),
        ("packet:4", True, "...xxx"),
        ("packet:4+2", False, "...xx."),
        ("p:1", False, "xxxxxx"),
        ("p:0", True, "......"),
    ],
)
def test_when_a_fault_happens(text: str, lasts: bool, expected: str) -> None:
    assert fires(text, lasts=lasts, at=SECONDS) == [c == "x" for c in expected]


def test_chance_is_as_likely_as_said_and_repeats_with_its_seed() -> None:
    at = [(0.0, number) for number in range(20_000)]
    first = fires("p:0.1", lasts=False, at=at)
    # Six standard deviations of a binomial: 6 * sqrt(20000 * 0.1 * 0.9) = 255.
    assert abs(sum(first) - 2000) < 255
    assert fires("p:0.1", lasts=False, at=at) == first
    # Asking twice about one packet is one draw.
    twice = fires("p:0.1", lasts=False, at=[pair for pair in at for _ in range(2)])
    assert twice[::2] == twice[1::2] == first


@given(st.floats(0.0, 1e6), st.one_of(st.none(), st.floats(0.0, 1e6)))
def test_times_are_read_back(start_s: float, duration_s: float | None) -> None:
    text = f"{start_s:.6f}" + ("" if duration_s is None else f"+{duration_s:.6f}")
    schedule = parse_schedule(text)
    assert schedule.start_s == pytest.approx(start_s, abs=1e-6)
    if duration_s is None:
        assert schedule.duration_s is None
    else:
        assert schedule.duration_s == pytest.approx(duration_s, abs=1e-6)


@given(st.integers(1, 10**6), st.one_of(st.none(), st.integers(1, 99)))
def test_packets_are_read_back(packet: int, count: int | None) -> None:
    text = f"packet:{packet}" + ("" if count is None else f"+{count}")
    assert parse_schedule(text) == Schedule(packet=packet, count=count)


@pytest.mark.parametrize(
    "text", ["", "x", "1+", "-1", "packet:", "packet:1.5", "p:", "p:x", "1e3", "nan"]
)
def test_other_forms_are_refused(text: str) -> None:
    with pytest.raises(ValueError, match="moment of a fault must be"):
        parse_schedule(text)


@pytest.mark.parametrize("text", ["p:1.5", "packet:0"])
def test_impossible_numbers_are_refused(text: str) -> None:
    with pytest.raises(ValueError, match=r"0\.\.1|counted from 1"):
        parse_schedule(text)
