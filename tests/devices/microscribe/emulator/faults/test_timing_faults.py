import itertools
from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

Connect = Callable[..., Any]
STREAM = b"\xcf\x00\x09\x03" + bytes(21)


def arrivals(
    client: Any, data: bytes, wait_s: float = 1.0
) -> list[tuple[float, bytes]]:
    """Give what comes, each piece with the time since ``data`` was written."""
    client.port.timeout = 0.0
    client.port.write(data)
    begun = client.now_s
    pieces: list[tuple[float, bytes]] = []
    while True:
        due = client.arm.next_s()
        if due is None or due > begun + wait_s:
            return pieces
        client.line.clock.sleep_until(due)
        if piece := client.port.read(1000):
            pieces.append((client.now_s - begun, piece))


@settings(
    max_examples=25,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
@given(st.integers(0, 999))
def test_f13_pieces_make_the_same_packet(
    connect: Connect, clean: bytes, seed: int
) -> None:
    client = connect("f13_chunks", seed=seed)
    assert client.sign_on() == b"IMMCMSCR\0"
    pieces = arrivals(client, b"\x03")
    assert b"".join(piece for _, piece in pieces) == clean
    assert len(pieces) > 3
    gaps = [b - a for (a, _), (b, _) in itertools.pairwise(pieces)]
    assert max(gaps) <= 0.052
    assert pieces[-1][0] < 0.06


def test_f14_bytes_come_in_bursts_and_in_order(connect: Connect, clean: bytes) -> None:
    client = connect("f14_bursts=50")
    client.sign_on()
    pieces = arrivals(client, STREAM, 1.0)
    times = [at for at, _ in pieces]
    begun = client.now_s - times[-1]
    assert all(
        ((begun + at) / 0.05) % 1.0
        in (pytest.approx(0.0, abs=1e-6), pytest.approx(1.0, abs=1e-6))
        for at in times
    )
    data = b"".join(piece for _, piece in pieces)
    assert data[:1] == b"\xcf"
    assert data[1:] == clean * (len(data) // 14)
    sizes = [len(piece) for _, piece in pieces[1:-1]]
    assert set(sizes) <= {4 * 14, 5 * 14, 6 * 14, *range(57, 84)}


@pytest.mark.parametrize(("fault", "late_s"), [("f15", 0.18), ("f15=400", 0.4)])
def test_f15_an_answer_comes_late_and_holds_back_the_next(
    connect: Connect, clean: bytes, fault: str, late_s: float
) -> None:
    client = connect(f"{fault}@packet:2")
    client.sign_on()
    assert client.poll() == [clean]
    pieces = arrivals(client, b"\x03")
    assert pieces[0][0] == pytest.approx(late_s + 0.001 + 2 * 10 / 115200)
    assert pieces[0][1] == b"\x83"
    assert client.poll() == [clean]


def test_f16_stall(connect: Connect, clean: bytes) -> None:
    client = connect("stall@packet:2")
    client.sign_on()
    assert client.poll(4) == [clean, clean[:7], b"", b""]
    assert client.arm.plugged


def test_f16_unplug_in_the_middle_of_a_packet(connect: Connect, clean: bytes) -> None:
    client = connect("unplug@packet:2")
    client.sign_on()
    assert client.poll() == [clean]
    client.port.timeout = 0.1
    client.port.write(b"\x03")
    assert client.port.read(7) == clean[:7]
    with pytest.raises(OSError, match="gone"):
        client.port.read(1)
    assert client.arm.lost_for_good


def test_f16_replug_elsewhere(connect: Connect, clean: bytes) -> None:
    client = connect("f16_cut_short=replug@packet:1")
    client.sign_on()
    with pytest.raises(OSError, match="gone"):
        client.poll()
    client.passes(0.9)
    with pytest.raises(OSError, match="gone"):
        client.line.open_serial()
    client.passes(0.2)
    before, client.port = client.port.port, client.line.open_serial(timeout=0.1)
    # Somebody has to look at the arm for its time to pass.
    assert client.poll() == [clean]
    assert client.port.port != before
    assert not client.arm.lost_for_good


def test_f30_slow_and_at_9600_only(connect: Connect, clean: bytes) -> None:
    assert b"MSCR" not in connect("f30_slow", baud=115200).sign_on()
    client = connect("f30_slow", baud=9600)
    assert client.sign_on() == b"IMMCMSCR\0"
    firsts = []
    for _ in range(50):
        pieces = arrivals(client, b"\x03", 0.2)
        assert b"".join(piece for _, piece in pieces) == clean
        wire_s = 2 * 10 / 9600
        firsts.append(pieces[0][0] - 0.001 - wire_s)
        client.passes(0.1)
    assert 0.001 <= min(firsts) < 0.006
    assert 0.025 < max(firsts) <= 0.030 + 1e-9
