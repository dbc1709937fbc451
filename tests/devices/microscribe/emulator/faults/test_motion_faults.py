import itertools
from collections.abc import Callable
from typing import Any

import pytest

from devices.microscribe.emulator.motion import AnglesMotion, StillMotion
from devices.microscribe.kinematics.profiles import DX40937, SIX_JOINTS, ArmProfile

Connect = Callable[..., Any]


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
