"""The kernel's interface for input devices, spoken to a far end that answers it.

The far end is a named pipe for the events and a function for the requests; the
requests' numbers are those of linux/input.h.
"""

import errno
import os
import struct
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.controls.linux_input import (
    EV_ABS,
    EV_KEY,
    EV_REL,
    EV_SYN,
    AxisRange,
    EventReader,
    InputDevice,
    InputEvent,
    input_devices,
)
from devices.port import DeviceError, DeviceReason

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="Linux's input system")

EVIOCSCLOCKID = 0x400445A0
EVIOCGNAME_256 = 0x81004506
EVIOCGKEY_96 = 0x80604518
EVIOCGBIT_KEY_96 = 0x80604521
EVIOCGBIT_REL_2 = 0x80024522
EVIOCGBIT_ABS_8 = 0x80084523
EVIOCGABS_0 = 0x80184540


def packed(event: InputEvent) -> bytes:
    seconds = int(event.time_s)
    micros = round((event.time_s - seconds) * 1e6)
    return struct.pack("@llHHi", seconds, micros, event.kind, event.code, event.value)


def mask(bits: set[int], length: int) -> bytes:
    return bytes(
        sum(1 << i for i in range(8) if 8 * byte + i in bits) for byte in range(length)
    )


@dataclass
class Kernel:
    """A pad with two sticks, one of them off its middle, and three buttons."""

    path: Path
    clock: int | None = None
    down: set[int] = field(default_factory=set)
    values: dict[int, int] = field(default_factory=lambda: {0: 10, 1: -10, 3: 0, 4: 7})
    refuses: bool = False

    def ioctl(self, file: int, request: int, data: bytes) -> bytes:
        if self.refuses:
            raise OSError(errno.ENODEV, os.strerror(errno.ENODEV))
        assert len(data) == (request >> 16) & 0x3FFF
        if EVIOCGABS_0 <= request < EVIOCGABS_0 + 0x40:
            value = self.values[request - EVIOCGABS_0]
            return struct.pack("@6i", value, -32768, 32767, 16, 128, 0)
        match request:
            case 0x400445A0:
                (self.clock,) = struct.unpack("@i", data)
                return data
            case 0x81004506:
                return "Päd".encode().ljust(256, b"\0")
            case 0x80604518:
                return mask(self.down, 96)
            case 0x80604521:
                return mask({0x130, 0x131, 0x2FF}, 96)
            case 0x80024522:
                return mask({8}, 2)
            case 0x80084523:
                return mask(set(self.values), 8)
        raise OSError(errno.EINVAL, os.strerror(errno.EINVAL))


@pytest.fixture
def kernel(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Kernel:
    import fcntl

    kernel = Kernel(tmp_path / "event7")
    os.mkfifo(kernel.path)
    monkeypatch.setattr(fcntl, "ioctl", kernel.ioctl)
    return kernel


@pytest.fixture
def line(kernel: Kernel) -> Iterator[int]:
    file = os.open(kernel.path, os.O_RDWR)
    yield file
    os.close(file)


events = st.lists(
    st.builds(
        InputEvent,
        st.integers(0, 2**31 - 1).map(float),
        st.integers(0, 0x1F),
        st.integers(0, 0x2FF),
        st.integers(-(2**31), 2**31 - 1),
    ),
    max_size=20,
)


@given(events, st.lists(st.integers(1, 60), max_size=40))
def test_events_survive_every_way_of_cutting_the_bytes(
    sent: list[InputEvent], cuts: list[int]
) -> None:
    data = b"".join(map(packed, sent))
    reader = EventReader()
    got: list[InputEvent] = []
    for cut in cuts:
        got += reader.feed(data[:cut])
        data = data[cut:]
    assert got + reader.feed(data) == sent


def test_a_device_says_what_it_is_and_what_happens(kernel: Kernel, line: int) -> None:
    device = InputDevice(kernel.path)
    assert kernel.clock == 1  # CLOCK_MONOTONIC, which time.monotonic() shows
    told = device.description
    assert told.name == "Päd"
    assert told.absolute == dict.fromkeys((0, 1, 3, 4), AxisRange(-32768, 32767, 128))
    assert told.relative == {8}
    assert told.keys == {0x130, 0x131, 0x2FF}
    assert device.read() == []
    sent = [InputEvent(1.5, EV_ABS, 0, 77), InputEvent(1.5, EV_KEY, 0x130, 1)]
    whole = b"".join(map(packed, sent))
    os.write(line, whole[:30])
    assert device.read() == sent[:1]
    os.write(line, whole[30:])
    assert device.read() == sent[1:]
    device.close()
    device.close()


def test_dropped_events_are_replaced_by_the_present_state(
    kernel: Kernel, line: int
) -> None:
    device = InputDevice(kernel.path)
    kernel.down = {0x131}
    old, gap = InputEvent(1.0, EV_KEY, 0x130, 1), InputEvent(2.0, EV_SYN, 3, 0)
    new = InputEvent(3.0, EV_REL, 8, 1)
    os.write(line, packed(old) + packed(gap) + packed(new))
    got = device.read()
    assert got[-1] == new
    assert old not in got
    state = {(e.kind, e.code): e.value for e in got[:-1]}
    assert {e.time_s for e in got[:-1]} == {2.0}
    assert state == {
        **{(EV_ABS, code): value for code, value in kernel.values.items()},
        (EV_KEY, 0x130): 0,
        (EV_KEY, 0x131): 1,
        (EV_KEY, 0x2FF): 0,
    }
    device.close()


def test_a_device_that_is_unplugged_says_so(kernel: Kernel) -> None:
    file = os.open(kernel.path, os.O_RDWR)
    device = InputDevice(kernel.path)
    os.close(file)
    with pytest.raises(DeviceError, match="event7 went away") as caught:
        device.read()
    assert caught.value.reason is DeviceReason.DISCONNECTED
    kernel.refuses = True
    with pytest.raises(DeviceError, match="went away"):
        device.state(0.0)
    device.close()


def test_what_is_no_input_device_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "event0"
    file.write_bytes(b"")
    with pytest.raises(DeviceError, match="no input device") as caught:
        InputDevice(file)
    assert caught.value.reason is DeviceReason.WRONG_DEVICE
    with pytest.raises(DeviceError, match="event9") as caught:
        InputDevice(tmp_path / "event9")
    assert caught.value.reason is DeviceReason.NO_PORT


def test_devices_are_listed_by_number(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("event10", "event9", "event2", "mouse0", "eventful", "js0"):
        (tmp_path / name).touch()
    assert [path.name for path in input_devices(tmp_path)] == [
        "event2",
        "event9",
        "event10",
    ]
    assert input_devices(tmp_path / "nothing") == []
    monkeypatch.setattr(sys, "platform", "win32")
    with pytest.raises(DeviceError, match="Linux"):
        input_devices(tmp_path)
