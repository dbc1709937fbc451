"""What each of the thirty faults does to a client's session."""

import itertools
from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from devices.microscribe.emulator.emulated_line import RATES
from devices.microscribe.emulator.motion import AnglesMotion, StillMotion
from devices.microscribe.kinematics.profiles import (
    DX40937,
    SIX_JOINTS,
    STANDARD,
    ArmProfile,
)

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


@pytest.mark.parametrize("fault", ["f2_one_rate", "f2=14400"])
def test_f2_one_rate_only(connect: Connect, fault: str) -> None:
    wanted = 14400 if "=" in fault else 19200
    heard = {rate: connect(fault, baud=rate).sign_on() for rate in RATES}
    assert heard.pop(wanted) == b"IMMC" + ID
    assert all(ID not in answer for answer in heard.values())


@pytest.mark.parametrize("count", [1, 2, 5, 20])
def test_f3_surplus_echoes_some_of_them_after_begin(
    connect: Connect, count: int
) -> None:
    client = connect(f"f3_surplus_echoes={count}")
    before = client.ask(b"IMMC")
    after = client.ask(b"BEGIN")
    assert before == b"IMMC" * (1 + count - count // 2)
    assert after == b"IMMC" * (count // 2) + ID
    assert client.ask(b"\xc5IMMCBEGIN") == b"\xc5IMMC" + ID, "once"


def test_f4_an_end_echo_in_front_of_the_first_attention(connect: Connect) -> None:
    client = connect("f4_end_echo")
    assert client.ask(b"IMMC") == b"\xc5IMMC"
    assert client.ask(b"IMMC") == b"IMMC"


def test_f5_begin_is_never_answered(connect: Connect) -> None:
    client = connect("f5_no_begin")
    assert [client.sign_on() for _ in range(2)] == [b"IMMC", b"IMMC"]
    assert client.ask(b"\x03") == b"", "no session was opened"


@pytest.mark.parametrize(
    ("fault", "product"), [("f6", b"IBOX"), ("f6=xxxx", b"XXXX"), ("f6=EMPTY", b"")]
)
def test_f6_another_product(connect: Connect, fault: str, product: bytes) -> None:
    assert connect(fault).sign_on() == b"IMMC" + product + b"\0"


@pytest.mark.parametrize(
    ("state", "first_try"),
    [("run", b"\xc5IMMC"), ("password", b""), ("args", b"")],
)
def test_f7_a_session_left_open(connect: Connect, state: str, first_try: bytes) -> None:
    client = connect(f"f7_left_open={state}")
    assert client.ask(b"\xc5IMMC") == first_try
    if state != "run":
        # Swallowed as data; the zeros that the rules provide free the arm.
        client.ask(b"\0" if state == "password" else bytes(26))
        assert client.ask(b"\xc5IMMC").endswith(b"\xc5IMMC")
    assert client.ask(b"BEGIN") == ID


def test_f7_a_stream_left_running(connect: Connect) -> None:
    client = connect("f7=motion")
    assert client.ask(b"", 0.1).count(b"\xa3") >= 9
    assert client.ask(b"\xc5IMMC").endswith(b"\xc5IMMC")
    assert client.ask(b"BEGIN") == ID


def test_f7_at_the_rate_of_the_dead_host(connect: Connect) -> None:
    client = connect("f7", baud=9600)
    assert b"IMMC" not in client.ask(b"\xc5IMMC")
    client.port.baudrate = 115200
    client.port.read(99)
    assert client.ask(b"\xc5IMMC") == b"\xc5IMMC"


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
def test_f9_one_byte_comes_twice(connect: Connect, clean: bytes, seed: int) -> None:
    heard = spoilt(connect, "f9_doubled_byte", seed, clean)
    assert len(heard) == len(clean) + 1
    assert clean in removals(heard)
    assert any(heard == clean[: i + 1] + clean[i:] for i in range(len(clean)))


@seeds
@given(st.integers(0, 999))
def test_f10_one_unprotected_bit(connect: Connect, clean: bytes, seed: int) -> None:
    heard = spoilt(connect, "f10_flipped_bit", seed, clean)
    flipped = [a ^ b for a, b in zip(heard, clean, strict=True)]
    assert sorted(flipped)[:-1] == [0] * 13
    assert max(flipped) in [1 << i for i in range(7)]
    assert heard[0] == clean[0]


@seeds
@given(st.integers(0, 999), st.sampled_from(("payload", "header")))
def test_f11_bit_seven_where_it_should_not_be(
    connect: Connect, clean: bytes, seed: int, where: str
) -> None:
    heard = spoilt(connect, f"f11={where}", seed, clean)
    flipped = [a ^ b for a, b in zip(heard, clean, strict=True)]
    assert sorted(flipped) == [0] * 13 + [0x80]
    assert (flipped[0] == 0x80) == (where == "header")


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


def test_f19_the_timer_wraps_a_second_later(connect: Connect) -> None:
    client = connect("f19_timer_wrap")
    client.sign_on()
    times = []
    for _ in range(40):
        begun = client.now_s
        times.append((begun, timer(client.ask(b"\x23", 0.05))))
    before = [ticks for at, ticks in times if at < 0.99]
    after = [ticks for at, ticks in times if at > 1.01]
    assert min(before) > 16384 - 900 - 1
    assert max(after) < 1000


def test_f19_a_pause_of_twenty_seconds(connect: Connect, clean: bytes) -> None:
    client = connect("f19=pause@1")
    client.sign_on()
    first = client.ask(b"\x23")
    client.passes(1.0)
    for _ in range(19):
        assert client.ask(b"\x03", 1.0) == b""
    client.passes(1.0)
    second = client.ask(b"\x23")
    assert second[4:] == clean[2:]
    # More than a wrap lies between: 18.204 s.
    assert (timer(second) - timer(first)) % 16384 == pytest.approx(
        21.08 * 900 - 16384, abs=20
    )


def test_f24_questions_only_until_the_home_button(
    connect: Connect, clean: bytes
) -> None:
    client = connect("f24_unhomed")
    assert client.sign_on() == b"IMMCMSCR\0"
    assert client.ask(b"\xcb") == b"\xcbEMU00001\0"
    assert client.poll(3) == [b""] * 3
    assert client.ask(STREAM) == b"\xcf"
    client.ask(b"\x00")
    client.arm.press_home_button(client.now_s)
    assert client.poll() == [clean]


@pytest.mark.parametrize("ignored", [1, 3])
def test_f26_a_stream_ignores_the_first_commands(
    connect: Connect, ignored: int
) -> None:
    client = connect(f"f26_stream_goes_on={ignored}")
    client.sign_on()
    assert client.ask(STREAM)[:2] == b"\xcf\xa3"
    for _ in range(ignored):
        assert b"\xa3" in client.ask(b"\x00", 0.1)
    client.ask(b"\x00", 0.1)
    assert client.ask(b"\xcb") == b"\xcbEMU00001\0"


def test_f28_the_host_hears_itself_and_the_arm_hears_nothing(connect: Connect) -> None:
    client = connect("f28_loopback")
    assert client.ask(b"\xc5IMMC") == b"\xc5IMMC"
    assert client.ask(b"BEGIN") == b"BEGIN"
    assert client.arm.packets == 0
    assert client.arm.firmware.state.name == "SYNC"


def test_f29_a_stranger_writes_to_the_memory_and_is_refused(
    connect: Connect, clean: bytes
) -> None:
    client = connect("f29_memory_write@packet:3")
    client.sign_on()
    before = client.ask(b"\xc0")
    packets = client.poll(4)
    assert client.arm.firmware.memory_writes == 1
    # The echo and the refusal reach the host, who never asked.
    assert b"".join(packets) == clean * 3 + b"\xc7\x00" + clean
    assert client.ask(b"\xc0") == before
    assert client.arm.fired == {"f29_memory_write": 1}


@pytest.mark.parametrize(
    ("fault", "answer"),
    [
        ("f20_bad_string", b"\xc8MicroScribe3D"),
        ("f20=long", b"\xc8MicroScribe3D" + b"x" * 27 + b"\0"),
        ("f20=non_ascii", b"\xc8\xe9icroScribe3D\0"),
        ("f20=empty", b"\xc8\0"),
    ],
)
def test_f20_a_string_breaks_a_rule_once(
    connect: Connect, fault: str, answer: bytes
) -> None:
    client = connect(fault)
    client.sign_on()
    assert client.ask(b"\xc8") == answer
    assert client.ask(b"\xc8") == b"\xc8MicroScribe3D\0"


def test_f20_counts_strings(connect: Connect) -> None:
    client = connect("f20=empty@packet:4")
    client.sign_on()
    answers = [client.ask(bytes((code,))) for code in range(0xC8, 0xCF)]
    assert [len(answer) == 2 for answer in answers] == [False] * 3 + [True] + [
        False
    ] * 3


@pytest.mark.parametrize("length", [0, 35, 37, 255])
def test_f21_a_block_of_another_length(connect: Connect, length: int) -> None:
    clean = connect()
    clean.sign_on()
    whole = clean.ask(b"\xc0")[2:]
    client = connect(f"f21_bad_parameters={length}")
    client.sign_on()
    for _ in range(2):
        answer = client.ask(b"\xc0")
        assert answer[:2] == bytes((0xC0, length))
        assert answer[2:] == (whole + bytes(255))[:length]
    assert client.ask(b"\xcd") == b"\xcdFormat DH0.5\0"


def test_f21_an_unknown_format(connect: Connect) -> None:
    client = connect("f21=format")
    client.sign_on()
    assert client.ask(b"\xcd") == b"\xcdFormat DH9.9\0"
    assert client.ask(b"\xcb") == b"\xcbEMU00001\0"
    assert len(client.ask(b"\xc0")) == 38


def test_f22_maxima_all_zero(connect: Connect) -> None:
    client = connect("f22_bad_maxima")
    client.sign_on()
    assert client.ask(b"\xc6") == b"\xc6" + bytes(24)


def test_f22_encoders_that_are_no_power_of_two_are_what_the_arm_then_has(
    connect: Connect,
) -> None:
    client = connect("f22=odd")
    client.sign_on()
    words = client.ask(b"\xc6")[13:]
    maxima = [words[i] << 8 | words[i + 1] for i in range(0, 12, 2)]
    assert maxima == [15999, 15999, 7999, 3999, 3999, 0]
    assert client.arm.profile.encoders.turn[:2] == (16000, 16000)
    # A quarter of a turn is a quarter of the new counts.
    motion = AnglesMotion(client.arm.profile, lambda t: [1.5707963267948966] * 6)
    assert motion.latch(0.0)[0][:5] == (4000, 4000, 2000, 1000, 1000)


@pytest.mark.parametrize(
    ("fault", "comment"),
    [("f23", b"Standard+Beta"), ("f23=standard", b"Standard")],
)
def test_f23_the_second_elbow_angle_is_kept_silent(
    connect: Connect, fault: str, comment: bytes
) -> None:
    for profile in (DX40937, STANDARD):
        client = connect(fault, profile=profile)
        client.sign_on()
        assert client.ask(b"\xcc") == b"\xcc" + comment + b"\0"
        assert client.ask(b"\xd3") == b""
        assert client.ask(b"\x00") == b"\x80\x00", "the session goes on"


def counts(packet: bytes) -> list[int]:
    return [packet[i] << 7 | packet[i + 1] for i in range(2, 14, 2)]


def turned(new: int, old: int) -> int:
    return (new - old + 8192) % 16384 - 8192


@pytest.mark.parametrize("profile", [DX40937, SIX_JOINTS])
def test_f18_every_encoder_wraps_both_ways_without_a_leap(
    connect: Connect, profile: ArmProfile
) -> None:
    still = StillMotion(profile)
    client = connect("f18_encoder_wrap", profile=profile, motion=still)
    client.sign_on()
    read = [counts(client.ask(b"\x03", 0.01)) for _ in range(3100)]
    built_in = 6 if profile is SIX_JOINTS else 5
    for joint in range(6):
        values = [row[joint] for row in read]
        steps = [turned(b, a) for a, b in itertools.pairwise(values)]
        if joint >= built_in:
            assert set(values) == {profile.home_counts[5]}
            continue
        rate = max(map(abs, steps)) / profile.encoders.turn[joint] * 360.0 / 0.01
        assert rate < 720.0, "a hand can turn a joint like this"
        leaps = [b - a for a, b in itertools.pairwise(values)]
        assert min(leaps) < -16000, "up through the end of the field"
        assert max(leaps) > 16000, "and down"
        assert len({value >> 12 for value in values}) == 4, "all winding bits"
        assert abs(sum(steps[:3000])) < 150, "and back"


def pedals(client: Any, count: int, period_s: float) -> list[int]:
    found = []
    for _ in range(count):
        client.port.timeout = period_s
        client.port.write(b"\x00")
        found.append(client.port.read(9)[1])
    return found


def test_f25_a_pedal_bounces_when_pressed_and_when_let_go(connect: Connect) -> None:
    client = connect("f25_pedals@1", seed=4)
    client.sign_on()
    seen = pedals(client, 1500, 0.0015)
    edges = [i for i, (a, b) in enumerate(itertools.pairwise(seen)) if a != b]
    assert set(seen) == {0, 1}
    assert len(edges) == 10
    times = [0.0015 * i for i in edges]
    pauses = [b - a for a, b in itertools.pairwise(times)]
    bounces = pauses[:4] + pauses[5:]
    assert all(0.0005 <= pause <= 0.0115 for pause in bounces)
    assert pauses[4] == pytest.approx(0.3, abs=0.05)
    assert times[0] == pytest.approx(1.0, abs=0.01)


def test_f25_both_pedals_in_one_packet(connect: Connect) -> None:
    client = connect("f25=both@1")
    client.sign_on()
    seen = pedals(client, 160, 0.01)
    assert set(seen) == {0, 3}
    assert sum(b == 3 for b in seen) in (29, 30, 31)


def test_f25_a_pedal_pressed_as_the_stream_stops(connect: Connect) -> None:
    client = connect("f25=stops")
    client.sign_on()
    stream = client.ask(b"\xcf\x00\x09\x03" + bytes(21), 0.2)
    assert {stream[i + 1] for i in range(1, len(stream) - 13, 14)} == {0}
    assert client.ask(b"\x00", 0.01)[-2:] == b"\x80\x01"
    client.passes(0.4)
    assert client.ask(b"\x00") == b"\x80\x00"


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
