import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.microscribe.emulator.answer import After, Answer, AnswerKind
from devices.microscribe.emulator.emulated_line import LATENCY_S, RATES, PacedOutput

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
    line.push(Answer(AnswerKind.PACKET, b"ab", after=After.STALL), 9600, 0.0)
    deliveries = [line.due(1.0), line.due(1.0)]
    assert [d.after for d in deliveries if d] == [None, After.STALL]
    line.push(Answer(AnswerKind.PACKET, b"ab"), 9600, 2.0)
    line.clear()
    assert line.next_s() is None
