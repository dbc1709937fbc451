import random
import sys

import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.microscribe.emulator_faults import parse_fault
from devices.microscribe.emulator_line import (
    LATENCY_S,
    FaultyLine,
    PacedOutput,
    client_rate,
)

RATES = (9600, 14400, 19200, 28800, 38400, 57600, 115200)


@given(
    st.lists(st.binary(min_size=1, max_size=30), min_size=1, max_size=6),
    st.sampled_from(RATES),
)
def test_bytes_arrive_in_order_at_the_lines_speed(
    chunks: list[bytes], baud: int
) -> None:
    line = PacedOutput()
    for chunk in chunks:
        line.push(chunk, baud, 0.0)
    got = bytearray()
    last = 0.0
    while (due := line.next_s()) is not None:
        assert due >= last
        last = due
        got += line.due(due)
    total = b"".join(chunks)
    assert bytes(got) == total
    assert last == pytest.approx(LATENCY_S + 10.0 * len(total) / baud)


def test_the_header_comes_ahead_of_its_packet() -> None:
    line = PacedOutput()
    line.push(b"\xa3rest", 115200, 0.0)
    first = line.next_s()
    assert first == pytest.approx(LATENCY_S + 10.0 / 115200)
    assert line.due(first or 0.0) == b"\xa3"


def test_a_fast_line_takes_no_time() -> None:
    line = PacedOutput(fast=True)
    line.push(b"abc", 9600, 5.0)
    assert line.due(5.0) == b"abc"


def test_faults_act_in_their_time_only() -> None:
    line = FaultyLine((parse_fault("mute@1+2"),), random.Random(0))
    heard = [line.to_client(b"ab", t) for t in (None, 0.5, 1.0, 2.9, 3.0)]
    assert heard == [b"ab", b"ab", b"", b"", b"ab"]
    line = FaultyLine((parse_fault("unplug@1"),), random.Random(0))
    assert [line.unplugged(t) for t in (None, 0.5, 1.0)] == [False, False, True]


def test_the_same_seed_gives_the_same_garbage() -> None:
    fault = (parse_fault("garbage@0"),)
    first, second = (FaultyLine(fault, random.Random(7)) for _ in range(2))
    assert first.to_client(b"x" * 16, 1.0) == second.to_client(b"x" * 16, 1.0)
    assert first.to_client(b"", 1.0) == b""


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="a Linux request")
@pytest.mark.parametrize("baud", RATES)
def test_the_clients_rate_is_read_from_the_terminal(baud: int) -> None:
    import os

    import serial

    master, client = os.openpty()
    try:
        with serial.Serial(os.ttyname(client), baud):
            assert client_rate(master) == baud
    finally:
        os.close(master)
        os.close(client)
