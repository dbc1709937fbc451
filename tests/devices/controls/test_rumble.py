"""Force feedback, spoken to a far end that answers as the kernel does.

The far end is a named pipe for what is played and a function for the requests; the
requests' numbers and the effect's layout are those of linux/input.h.
"""

import ctypes
import errno
import os
import struct
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from devices.controls.rumble import (
    LENGTH_MS,
    PULSE_MS,
    RENEWED_S,
    WEAKEST,
    Rumble,
    open_rumble,
)

pytestmark = pytest.mark.skipif(
    sys.platform != "linux" or struct.calcsize("P") != 8, reason="64-bit Linux"
)

EVIOCSFF = 0x40304580
EVIOCGBIT_FF_16 = 0x80104535
EVENT = struct.Struct("@llHHi")


class Effect(ctypes.Structure):
    """struct ff_effect, its union as rumble; a periodic effect makes it 48 bytes."""

    _fields_ = [
        ("type", ctypes.c_uint16),
        ("id", ctypes.c_int16),
        ("direction", ctypes.c_uint16),
        ("trigger", ctypes.c_uint16 * 2),
        ("length", ctypes.c_uint16),
        ("delay", ctypes.c_uint16),
        ("strong", ctypes.c_uint16),
        ("weak", ctypes.c_uint16),
        ("rest", ctypes.c_uint8 * 28),
    ]


@dataclass
class Pad:
    """A pad with motors, as the kernel shows it."""

    path: Path
    effects: dict[int, Effect] = field(default_factory=dict)
    uploads: int = 0
    rumbles: bool = True
    is_there: bool = True

    def ioctl(self, file: int, request: int, data: bytes) -> bytes:
        if not self.is_there:
            raise OSError(errno.ENODEV, os.strerror(errno.ENODEV))
        if request == EVIOCGBIT_FF_16:
            mask = bytearray(16)
            if self.rumbles:
                mask[0x50 // 8] = 1 << 0x50 % 8
            return bytes(mask)
        assert request == EVIOCSFF
        assert len(data) == 48
        # the union begins where a pointer may stand
        effect = Effect.from_buffer_copy(data[:14] + data[16:48] + bytes(2))
        assert effect.type == 0x50
        if effect.id == -1:
            effect.id = len(self.effects)
        assert effect.id <= len(self.effects)
        self.effects[effect.id] = effect
        self.uploads += 1
        return data[:2] + struct.pack("@h", effect.id) + data[4:]


@pytest.fixture
def pad(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Pad:
    import fcntl

    pad = Pad(tmp_path / "event7")
    os.mkfifo(pad.path)
    monkeypatch.setattr(fcntl, "ioctl", pad.ioctl)
    return pad


@pytest.fixture
def line(pad: Pad) -> Iterator[int]:
    file = os.open(pad.path, os.O_RDWR | os.O_NONBLOCK)
    yield file
    os.close(file)


def played(line: int) -> list[tuple[int, int]]:
    """What was played or stopped since the last look: effect and value."""
    try:
        data = os.read(line, 100 * EVENT.size)
    except BlockingIOError:
        return []
    events = list(EVENT.iter_unpack(data))
    assert {kind for _, _, kind, _, _ in events} <= {0x15}
    return [(code, value) for _, _, _, code, value in events]


class Clock:
    def __init__(self) -> None:
        self.s = 100.0

    def __call__(self) -> float:
        return self.s


def opened(pad: Pad) -> tuple[Rumble, Clock]:
    clock = Clock()
    return Rumble(os.open(pad.path, os.O_WRONLY | os.O_NONBLOCK), clock), clock


def test_force_sets_the_strength_and_no_force_stops(pad: Pad, line: int) -> None:
    rumble, clock = opened(pad)
    rumble.follow(0.0)
    assert (played(line), pad.uploads) == ([], 0)  # still pads are left alone
    for strength in (0.3, 1.0):
        rumble.follow(strength)
        effect = pad.effects[0]
        motor = round(0xFFFF * (WEAKEST + (1.0 - WEAKEST) * strength))
        assert (effect.strong, effect.weak) == (motor, motor)
        assert (effect.length, effect.delay) == (LENGTH_MS, 0)
        assert played(line) == [(0, 1)]
        clock.s += 0.05
    rumble.follow(0.0)
    assert played(line) == [(0, 0)]
    assert len(pad.effects) == 1  # the one effect is changed, not added to
    rumble.close()


def test_more_force_is_stronger(pad: Pad, line: int) -> None:
    rumble, _ = opened(pad)
    motors = []
    for percent in range(5, 101, 5):
        rumble.follow(percent / 100)
        motors.append(pad.effects[0].strong)
    assert motors == sorted(set(motors))
    assert motors[-1] == 0xFFFF
    rumble.close()


def test_a_press_that_goes_on_is_renewed_before_it_ends(pad: Pad, line: int) -> None:
    rumble, clock = opened(pad)
    rumble.follow(0.5)
    for _ in range(100):
        clock.s += 0.02
        rumble.follow(0.5)
    # every RENEWED_S, and not with every frame
    assert 2.0 / RENEWED_S * 0.8 <= pad.uploads <= 2.0 / RENEWED_S + 2
    assert RENEWED_S * 1e3 < LENGTH_MS
    rumble.close()


def test_a_break_is_a_pulse_of_full_strength_that_nothing_cuts_short(
    pad: Pad, line: int
) -> None:
    rumble, clock = opened(pad)
    rumble.follow(0.4)
    rumble.pulse()
    effect = pad.effects[0]
    assert (effect.strong, effect.weak) == (0xFFFF, 0xFFFF)
    assert effect.length == PULSE_MS  # the kernel ends it
    played(line)
    clock.s += PULSE_MS / 2e3
    rumble.follow(0.0)
    assert played(line) == []
    clock.s += PULSE_MS / 1e3
    rumble.follow(0.0)
    assert played(line) == [(0, 0)]
    rumble.close()


def test_it_stops_at_the_end_and_lets_go(pad: Pad, line: int) -> None:
    rumble, _ = opened(pad)
    rumble.pulse()
    rumble.stop()
    assert played(line) == [(0, 1), (0, 0)]
    rumble.follow(0.7)
    rumble.close()
    assert played(line)[-1] == (0, 0)
    rumble.close()
    rumble.follow(1.0)
    rumble.pulse()
    assert played(line) == []


def test_a_pad_that_is_unplugged_is_left_alone(pad: Pad, line: int) -> None:
    rumble, _ = opened(pad)
    rumble.follow(0.5)
    pad.is_there = False
    rumble.follow(0.9)
    pad.is_there = True
    uploads = pad.uploads
    for call in (rumble.pulse, rumble.stop, rumble.close):
        call()
    assert pad.uploads == uploads


@pytest.mark.parametrize("strength", [float("nan"), -1.0, float("-inf")])
def test_a_strength_that_is_none_is_still(pad: Pad, line: int, strength: float) -> None:
    rumble, _ = opened(pad)
    rumble.follow(strength)
    assert pad.uploads == 0
    rumble.close()


def test_only_what_can_rumble_is_opened(pad: Pad, line: int) -> None:
    rumble = open_rumble(pad.path)
    assert rumble is not None
    rumble.close()
    pad.rumbles = False
    assert open_rumble(pad.path) is None
    pad.is_there = False
    assert open_rumble(pad.path) is None
    assert open_rumble(pad.path.with_name("event8")) is None
