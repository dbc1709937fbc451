"""What each of the thirty faults does to a client's session."""

import itertools
from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from devices.microscribe.emulator.motion import AnglesMotion, StillMotion
from devices.microscribe.kinematics.profiles import DX40937

Connect = Callable[..., Any]
ID = b"MSCR\0"


def test_f1_nothing_is_answered(connect: Connect) -> None:
    client = connect("f1_never_answers")
    assert client.sign_on() == b""
    late = connect("f1@1+1")
    assert late.sign_on() == b"IMMC" + ID
    assert [bool(packet) for packet in late.poll(30)] == (
        [True] * 10 + [False] * 10 + [True] * 10
    )


seeds = settings(
    max_examples=25,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)


def spoilt(connect: Connect, fault: str, seed: int, clean: bytes) -> bytes:
    """Give the second of three packets; the others must be whole."""
    client = connect(f"{fault}@packet:2", seed=seed)
    client.sign_on()
    first, second, third = client.poll(3)
    assert first == third == clean
    packet: bytes = second
    return packet


def removals(data: bytes) -> set[bytes]:
    return {data[:i] + data[i + 1 :] for i in range(len(data))}


@seeds
@given(st.integers(0, 999))
def test_f8_one_byte_is_lost(connect: Connect, clean: bytes, seed: int) -> None:
    assert spoilt(connect, "f8", seed, clean) in removals(clean)


@pytest.mark.parametrize("at", [0, 1, 13, 99])
def test_f8_at_a_place(connect: Connect, clean: bytes, at: int) -> None:
    place = min(at, 13)
    heard = spoilt(connect, f"f8_dropped_byte={at}", 0, clean)
    assert heard == clean[:place] + clean[place + 1 :]


@seeds
@given(st.integers(0, 999))
def test_f10_one_unprotected_bit(connect: Connect, clean: bytes, seed: int) -> None:
    heard = spoilt(connect, "f10_flipped_bit", seed, clean)
    flipped = [a ^ b for a, b in zip(heard, clean, strict=True)]
    assert sorted(flipped)[:-1] == [0] * 13
    assert max(flipped) in [1 << i for i in range(7)]
    assert heard[0] == clean[0]


@seeds
@given(st.integers(0, 999), st.sampled_from(("mixed", "low", "high")))
def test_f12_noise_between_packets(
    connect: Connect, clean: bytes, seed: int, kind: str
) -> None:
    heard = spoilt(connect, f"f12_noise={kind}", seed, clean)
    assert heard.endswith(clean)
    noise = heard[: -len(clean)]
    assert 1 <= len(noise) <= 8
    if kind != "mixed":
        assert {byte >> 7 for byte in noise} == {int(kind == "high")}


def test_garbage_has_about_the_length_and_not_the_sense(
    connect: Connect, clean: bytes
) -> None:
    client = connect("garbage@0.05+0.1")
    assert client.sign_on() == b"IMMCMSCR\0"
    first, second, third = client.poll(3)
    assert (first, third) == (clean, clean)
    assert 14 <= len(second) <= 16
    assert second[:14] != clean


def test_by_chance_each_packet_is_hit_with_the_same_probability(
    connect: Connect, clean: bytes
) -> None:
    client = connect("f8@p:0.2", seed=3)
    client.sign_on()
    hit = [packet != clean for packet in client.poll(500)]
    assert 60 < sum(hit) < 140
    assert client.arm.fired == {"f8_dropped_byte": sum(hit)}
    again = connect("f8@p:0.2", seed=3)
    again.sign_on()
    assert [packet != clean for packet in again.poll(500)] == hit


PLAIN_STREAM = b"\xcf\x00\x09\x03" + bytes(21)


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


def test_f14_bytes_come_in_bursts_and_in_order(connect: Connect, clean: bytes) -> None:
    client = connect("f14_bursts=50")
    client.sign_on()
    pieces = arrivals(client, PLAIN_STREAM, 1.0)
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


STREAM = b"\xcf\x00\x09\x23" + bytes(21)
ELSEWHERE = (1, 2, 3, 4, 5, 8416)


def timer(packet: bytes) -> int:
    return packet[2] << 7 | packet[3]


def test_f17_a_power_cycle_far_from_the_rest_pose(
    connect: Connect, clean: bytes
) -> None:
    client = connect("f17_power_cycle@1", motion=StillMotion(DX40937, ELSEWHERE))
    client.sign_on()
    for _ in range(5):
        packet = client.ask(b"\x23", 0.19)
        assert packet[4:6] == b"\x00\x01"
    client.passes(0.2)
    assert client.ask(b"\x23") == b"", "the session is gone"
    assert client.sign_on() == b"IMMCMSCR\0"
    packet = client.ask(b"\x23")
    assert packet[4:] == clean[2:], "the counts of the rest pose"
    assert timer(packet) < 0.5 * 900


def counts(packet: bytes) -> list[int]:
    return [packet[i] << 7 | packet[i + 1] for i in range(2, 14, 2)]


def turned(new: int, old: int) -> int:
    return (new - old + 8192) % 16384 - 8192


def turning(t_s: float) -> list[float]:
    return [0.2 * t_s] * 6


def test_f27_encoders_that_are_dead_run_backwards_or_miss_counts(
    connect: Connect,
) -> None:
    rows = {}
    for fault in (
        "f4",
        "f27_sick_encoder@1+1",
        "f27=backwards0@1+1",
        "f27=missed1@1+1",
    ):
        client = connect(fault, motion=AnglesMotion(DX40937, turning))
        client.sign_on()
        rows[fault.partition("@")[0]] = [counts(p) for p in client.poll(30)]
    clean = rows.pop("f4")
    ill = slice(11, 20)
    for name, joint in (
        ("f27_sick_encoder", 2),
        ("f27=backwards0", 0),
        ("f27=missed1", 1),
    ):
        read = rows[name]
        for other in set(range(6)) - {joint}:
            assert [r[other] for r in read] == [r[other] for r in clean]
        assert [r[joint] for r in read[:10]] == [r[joint] for r in clean[:10]]
        truth = [r[joint] for r in clean]
        mine = [r[joint] for r in read]
        steps = [turned(b, a) for a, b in itertools.pairwise(mine[ill])]
        right = [turned(b, a) for a, b in itertools.pairwise(truth[ill])]
        if name.endswith("encoder"):
            assert steps == [0] * len(steps)
            assert mine[21:] == truth[21:]
        elif "backwards" in name:
            assert steps == [-step for step in right]
        else:
            missed = [r - s for r, s in zip(right, steps, strict=True)]
            assert all(1 <= miss <= 5 for miss in missed)
            lost = {turned(t, m) for t, m in zip(truth[21:], mine[21:], strict=True)}
            assert len(lost) == 1, "what was missed stays missing"
            assert 10 <= lost.pop() <= 50
