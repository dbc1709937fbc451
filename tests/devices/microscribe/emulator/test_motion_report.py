from hypothesis import given
from hypothesis import strategies as st

from devices.microscribe.emulator.motion_report import MotionReport, Reading

START = Reading((100, 200, 300, 400, 500, 600), 0, (10,) * 8)


def report(
    buttons: int = 0, analog: bytes = bytes(8), words: bytes = bytes(12)
) -> MotionReport:
    arguments = bytes((0, 9, 0x23, buttons)) + analog + words
    return MotionReport(arguments, 0.0, START)


def test_delay_command_and_fixed_rate_are_read() -> None:
    fixed = report()
    assert (fixed.period_s, fixed.command, fixed.is_fixed_rate) == (0.01, 0x23, True)
    assert fixed.wants(START)


@given(st.integers(0, 5), st.integers(1, 200), st.integers(-8191, 8191))
def test_an_encoder_triggers_from_its_threshold_on(
    joint: int, limit: int, turned: int
) -> None:
    words = bytearray(12)
    words[2 * joint : 2 * joint + 2] = limit.to_bytes(2, "big")
    counts = list(START.counts)
    counts[joint] = (counts[joint] + turned) % 16384
    moved = Reading(tuple(counts), 0, START.analog)
    assert report(words=bytes(words)).wants(moved) == (abs(turned) >= limit)
    # A joint whose threshold is zero never triggers.
    others = bytes(words[2:] + words[:2])
    assert not report(words=others).wants(moved)


@given(st.integers(1, 15), st.integers(0, 15))
def test_a_button_triggers_at_both_edges_if_its_bit_is_asked_for(
    mask: int, pressed: int
) -> None:
    down = Reading(START.counts, pressed, START.analog)
    assert report(buttons=mask).wants(down) == bool(mask & pressed)
    held = MotionReport(report(buttons=mask).arguments, 0.0, down)
    assert held.wants(START) == bool(mask & pressed)


def test_an_analog_channel_triggers_from_its_threshold_on() -> None:
    limits = bytes((0, 5, 0, 0, 0, 0, 0, 0))
    for change, triggers in ((4, False), (5, True), (-5, True)):
        analog = (10, 10 + change, *START.analog[2:])
        moved = Reading(START.counts, 0, analog)
        assert report(analog=limits).wants(moved) == triggers
