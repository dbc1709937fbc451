"""A tool's device beside the scope's: joined by time, lost and found again."""

import math
import random

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices import DeviceError, Pose
from devices.port import DeviceReason
from paravol.inputs import second_device
from paravol.inputs.second_device import OLDEST_S, PoseJoin, SecondDevice

times = st.lists(
    st.integers(0, 1000).map(lambda n: n / 100.0), min_size=1, max_size=30, unique=True
)


def pose(time_s: float) -> Pose:
    frame = np.eye(4)
    frame[0, 3] = 100.0 * time_s
    return Pose(time_s, time_s, frame, 0)


@given(times, times, st.randoms(use_true_random=False))
def test_the_join_is_the_newest_by_then_whatever_order_poses_come_in(
    measured: list[float], asked: list[float], chance: random.Random
) -> None:
    """However two streams interleave, what is known by a time decides, and no more."""
    waiting = [pose(t) for t in measured]
    chance.shuffle(waiting)
    join, other = PoseJoin(), PoseJoin()
    for each in sorted(waiting, key=lambda p: p.host_time_s):
        other.put(each)
    for time_s in sorted(asked):
        # some come early, some only just in time
        kept = []
        for each in waiting:
            if each.host_time_s <= time_s or chance.random() < 0.3:
                join.put(each)
            else:
                kept.append(each)
        waiting = kept
        known = [t for t in measured if t <= time_s]
        found, same = join.at(time_s), other.at(time_s)
        assert (found is None) == (not known) == (same is None)
        if found is not None and same is not None:
            assert found.host_time_s == same.host_time_s == max(known)


class Scripted:
    """A source whose next answers are given: poses, or an error to raise."""

    def __init__(self) -> None:
        self.next: list[Pose] | Exception = []

    def drain(self) -> list[Pose]:
        given, self.next = self.next, []
        if isinstance(given, Exception):
            raise given
        return given


def heard(device: SecondDevice) -> list[str]:
    told: list[str] = []
    device.on_loss = lambda text: told.append(f"lost: {text}")
    device.on_return = lambda text: told.append(f"back: {text}")
    return told


def test_a_silent_device_freezes_then_goes_and_comes_back() -> None:
    source = Scripted()
    device = SecondDevice(source, "pad")
    told = heard(device)
    assert device.at(0.0) is None
    assert told == []
    source.next = [pose(1.0)]
    for time_s in (1.0, 1.0 + OLDEST_S):
        found = device.at(time_s)
        assert found is not None
        assert found.time_s == 1.0
    for time_s in (1.3, 1.5, 2.0):
        assert device.at(time_s) is None
    assert len(told) == 1
    assert told[0].startswith("lost: pad")
    source.next = [pose(2.5)]
    assert device.at(2.5) is not None
    assert told[1:] == ["back: pad is back."]


def test_one_that_fails_is_opened_again_from_where_it_is(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    now = [0.0]
    monkeypatch.setattr("time.monotonic", lambda: now[0])
    gone = DeviceError(DeviceReason.DISCONNECTED, "It went away.")
    source, replacement = Scripted(), Scripted()
    tries = []

    def again() -> Scripted:
        tries.append(now[0])
        if now[0] < 2.0:
            raise DeviceError(DeviceReason.NO_PORT, "Not there.")
        return replacement

    device = SecondDevice(source, "pad", again)
    told = heard(device)
    source.next = [pose(0.0)]
    assert device.at(0.0) is not None
    source.next = gone
    # the last pose is held for a moment, the flight never sees an error
    assert device.at(0.1) is not None
    for step in range(1, 40):
        now[0] = 0.1 * step
        replacement.next = [pose(now[0])] if now[0] >= 2.0 else []
        found = device.at(now[0])
        is_back = max(tries, default=0.0) >= 2.0
        assert (found is None) == (now[0] > OLDEST_S and not is_back)
    assert [text[:4] for text in told] == ["lost", "back"]
    assert np.diff(tries).min() >= second_device.RETRY_S - 1e-9


@given(
    st.lists(
        st.one_of(
            st.sampled_from(list(DeviceReason)),
            st.lists(st.floats(0.0, 5.0), max_size=3),
        ),
        max_size=25,
    )
)
def test_no_garbage_of_a_device_reaches_the_flight(script: list[object]) -> None:
    source = Scripted()
    device = SecondDevice(source, "pad")
    told = heard(device)
    for step, news in enumerate(script):
        if isinstance(news, DeviceReason):
            source.next = DeviceError(news, "Trouble.")
        elif isinstance(news, list):
            source.next = [pose(float(t)) for t in news]
        found = device.at(0.2 * step)
        if found is not None:
            assert 0.0 <= 0.2 * step - found.host_time_s <= OLDEST_S + 1e-12
    kinds = [text[:4] for text in told]
    assert kinds == ["lost" if n % 2 == 0 else "back" for n in range(len(kinds))]


def test_an_end_is_told_once_and_too_many_poses_are_no_loss() -> None:
    source = Scripted()
    device = SecondDevice(source, "recording")
    told = heard(device)
    source.next = DeviceError(DeviceReason.OVERRUN, "Many were lost.")
    assert device.at(0.0) is None
    source.next = [pose(0.1)]
    assert device.at(0.1) is not None
    source.next = EOFError("over")
    for step in range(5):
        device.at(0.2 + 0.1 * step)
    assert len(told) == 1
    assert "end" in told[0]
    assert math.isfinite(OLDEST_S)
