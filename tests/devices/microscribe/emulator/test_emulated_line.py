import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.microscribe.emulator.answer import Answer, AnswerKind, ReplyTrigger
from devices.microscribe.emulator.emulated_line import (
    LATENCY_S,
    RATES,
    PacedOutput,
    misread,
)

answers = st.builds(
    lambda data, delay: Answer(AnswerKind.PACKET, data, delay),
    st.binary(min_size=1, max_size=30),
    st.sampled_from((0.0, 0.02)),
)


def collect(line: PacedOutput) -> list[tuple[float, bytes]]:
    out = []
    while (due := line.next_s()) is not None:
        assert line.due(due - 1e-9) is None
        delivery = line.due(due)
        assert delivery is not None
        out.append((due, delivery.data))
    return out


@given(st.lists(answers, min_size=1, max_size=6), st.sampled_from(RATES))
def test_bytes_arrive_in_order_at_the_lines_speed(
    said: list[Answer], rate: int
) -> None:
    line = PacedOutput()
    for answer in said:
        line.push(answer, rate, 0.0)
    got = collect(line)
    total = b"".join(answer.data for answer in said)
    assert b"".join(data for _, data in got) == total
    assert [at for at, _ in got] == sorted(at for at, _ in got)
    delays = sum(answer.delay_s for answer in said)
    assert got[-1][0] == pytest.approx(LATENCY_S + delays + 10.0 * len(total) / rate)
    # Nowhere faster than the line.
    heard = 0
    for at, data in got:
        heard += len(data)
        assert heard <= (at - LATENCY_S) * rate / 10.0 + 1e-6


def test_the_header_comes_ahead_of_its_packet() -> None:
    line = PacedOutput()
    line.push(Answer(AnswerKind.PACKET, b"\xa3rest"), 115200, 0.0)
    first, last = collect(line)
    assert (first[1], last[1]) == (b"\xa3", b"rest")
    assert first[0] == pytest.approx(LATENCY_S + 10.0 / 115200)
    assert last[0] == pytest.approx(LATENCY_S + 50.0 / 115200)


def test_a_fast_line_takes_no_time() -> None:
    line = PacedOutput(fast=True)
    line.push(Answer(AnswerKind.PACKET, b"abc"), 9600, 5.0)
    assert collect(line) == [(5.0, b"abc")]


def test_a_later_arrival_keeps_the_order() -> None:
    line = PacedOutput(arrival=lambda at: 0.5 if at < 0.0012 else at)
    line.push(Answer(AnswerKind.PACKET, b"ab"), 9600, 0.0)
    line.push(Answer(AnswerKind.PACKET, b"c"), 115200, 0.4)
    assert b"".join(data for _, data in collect(line)) == b"abc"


def test_what_happens_after_an_answer_comes_with_its_last_byte() -> None:
    line = PacedOutput()
    line.push(Answer(AnswerKind.PACKET, b"ab", after=ReplyTrigger.STALL), 9600, 0.0)
    deliveries = [line.due(1.0), line.due(1.0)]
    assert [d.after for d in deliveries if d] == [None, ReplyTrigger.STALL]
    line.push(Answer(AnswerKind.PACKET, b"ab"), 9600, 2.0)
    line.clear()
    assert line.next_s() is None


PAIRS = [(host, arm) for host in RATES for arm in RATES if host != arm]
SET_BAUD = 0x44


def commands(data: bytes, host: int, arm: int) -> set[int]:
    """Give the configuration commands that an arm in a session would hear."""
    return {byte & 0x7F for byte in misread(data, host, arm) if byte & 0x40}


@given(st.binary(max_size=40), st.sampled_from(RATES), st.booleans())
def test_equal_rates_change_nothing(data: bytes, rate: int, keep: bool) -> None:
    assert misread(data, rate, rate, keep) == data


@given(st.binary(max_size=40), st.sampled_from(RATES), st.booleans())
def test_two_percent_of_error_change_nothing(
    data: bytes, rate: int, keep: bool
) -> None:
    """Half a bit in ten is what the frame allows."""
    assert misread(data, rate * 102 // 100, rate, keep) == data
    assert misread(data, rate * 98 // 100, rate, keep) == data


@given(st.binary(max_size=40), st.sampled_from(RATES), st.sampled_from(RATES))
def test_no_bytes_come_from_nowhere(data: bytes, host: int, arm: int) -> None:
    heard = misread(data, host, arm)
    kept = misread(data, host, arm, keep_framing_errors=True)
    assert len(heard) <= len(kept) <= max(1, len(data) * arm / host + len(data))
    left = iter(kept)
    assert all(byte in left for byte in heard), "dropping keeps the order"
    if not data:
        assert kept == b""


def test_without_the_end_in_front_a_sign_on_may_change_the_rate() -> None:
    for host, arm in PAIRS:
        heard = misread(b"IMMC", host, arm)
        assert (heard == b"\xde\xc4") == (host == 2 * arm)
        assert (SET_BAUD in commands(bytes(26), host, arm)) == (
            (host, arm) == (38400, 14400)
        )
