"""The loudspeaker: silent where there is none, never waited for, never stale."""

import math
import sys
import threading
from collections.abc import Generator
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from paravol.feedback.sound import LOUDEST, STALE_S, SoundPlayer
from paravol.feedback.tones import RATE_HZ, SILENCE, Tick
from paravol.feedback.touch_signs import TouchSigns

NEAR = TouchSigns(hazard=("orbit", 0.0))


class Device:
    """A loudspeaker that asks when it is told to."""

    def __init__(self) -> None:
        self.started = threading.Event()
        self.closed = threading.Event()
        self.blocks: Generator[bytes, int, None] | None = None

    def start(self, blocks: Generator[bytes, int, None]) -> None:
        self.blocks = blocks
        self.started.set()

    def play(self, count: int) -> NDArray[np.float32]:
        assert self.blocks is not None
        return np.frombuffer(self.blocks.send(count), dtype=np.float32)

    def close(self) -> None:
        self.closed.set()


def started(**options: Any) -> tuple[SoundPlayer, Device]:
    device = Device()
    player = SoundPlayer(open_device=lambda: device, **options)
    player.start()
    assert device.started.wait(5.0)
    return player, device


def test_the_newest_signs_are_heard_and_the_volume_bounds_them() -> None:
    player, device = started(volume=0.6)
    assert not device.play(480).any()
    player.follow(NEAR)
    device.play(RATE_HZ // 10)
    heard = device.play(RATE_HZ // 10)
    assert 0.0 < np.abs(heard).max() <= 0.6 * LOUDEST
    assert player.louder(-9) == 0.0
    device.play(RATE_HZ // 10)
    assert not device.play(480).any()
    player.close()
    player.close()
    assert device.closed.is_set()


def test_muting_and_falling_quiet_end_in_silence() -> None:
    player, device = started()
    for silence, back in (
        (player.switch, player.switch),
        (player.quiet, lambda: player.follow(NEAR)),
    ):
        player.follow(NEAR)
        device.play(RATE_HZ // 10)
        assert device.play(480).any()
        silence()
        player.strike(Tick.BREAK) if not player.is_on else None
        device.play(RATE_HZ // 10)
        assert not device.play(480).any()
        back()
    player.close()


def test_signs_that_are_no_longer_live_are_not_played() -> None:
    player = SoundPlayer(open_device=Device)
    player.follow(NEAR)
    import time

    now = time.monotonic()
    assert player.cues(now).volume == LOUDEST
    assert player.cues(now + STALE_S + 0.1).volume == 0.0
    player.quiet()
    assert player.cues(now).volume == SILENCE.volume


def test_a_tick_is_heard_once() -> None:
    player, device = started()
    player.follow(TouchSigns())
    device.play(RATE_HZ // 10)
    player.strike(Tick.BREAK)
    assert device.play(2400).any()
    device.play(RATE_HZ // 5)
    assert not device.play(2400).any()
    player.close()


def test_why_there_is_no_sound_is_told_once_and_flying_goes_on() -> None:
    told: list[str] = []
    heard = threading.Event()

    def hear(text: str) -> None:
        told.append(text)
        heard.set()

    def refuse() -> Any:
        raise OSError("ALSA lib confused")

    player = SoundPlayer(told=hear, open_device=refuse)
    player.start()
    assert heard.wait(5.0)
    for _ in range(3):
        player.start()
        player.follow(NEAR)
        player.strike(Tick.BITE)
        player.switch()
    player.close()
    assert told == ["No sound: this machine has no loudspeaker. (ALSA lib confused)"]


def test_without_the_library_it_says_how_to_get_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(sys.modules, "miniaudio", None)
    told: list[str] = []
    heard = threading.Event()

    def hear(text: str) -> None:
        told.append(text)
        heard.set()

    player = SoundPlayer(told=hear)
    player.start()
    assert heard.wait(5.0)
    assert "pip install" in told[0]


def test_a_sound_server_that_does_not_answer_holds_nobody_up() -> None:
    answers, device = threading.Event(), Device()

    def slow() -> Device:
        answers.wait(10.0)
        return device

    player = SoundPlayer(open_device=slow)
    player.start()
    player.follow(NEAR)
    player.close()  # returns though the server has not answered
    answers.set()
    # what it opens at last is closed at once
    assert device.closed.wait(5.0)


def test_sound_that_is_off_opens_nothing_until_it_is_turned_on() -> None:
    opened = threading.Event()
    device = Device()

    def open_device() -> Device:
        opened.set()
        return device

    player = SoundPlayer(is_on=False, open_device=open_device)
    player.start()
    assert not opened.is_set()
    assert player.switch()
    assert device.started.wait(5.0)
    player.close()
    assert SoundPlayer(open_device=open_device).cues(0.0).hazard_mm == math.inf


def test_a_real_device_of_the_library_asks_for_blocks_in_its_own_thread() -> None:
    miniaudio = pytest.importorskip("miniaudio")

    def nowhere() -> Any:
        """The library's own thread, without a loudspeaker behind it."""
        return miniaudio.PlaybackDevice(
            output_format=miniaudio.SampleFormat.FLOAT32,
            nchannels=1,
            sample_rate=RATE_HZ,
            buffersize_msec=10,
            backends=[miniaudio.Backend.NULL],
        )

    asked: list[tuple[int, str]] = []
    enough = threading.Event()

    class Watched(SoundPlayer):
        def blocks(self) -> Generator[bytes, int, None]:
            own = super().blocks()
            count = yield next(own)
            while True:
                block = own.send(count)
                asked.append((len(block) // 4 - count, threading.current_thread().name))
                if len(asked) == 5:
                    enough.set()
                count = yield block

    player = Watched(open_device=nowhere)
    player.start()
    assert enough.wait(10.0)
    player.close()
    assert {wrong for wrong, _ in asked} == {0}
    assert threading.main_thread().name not in {name for _, name in asked}
