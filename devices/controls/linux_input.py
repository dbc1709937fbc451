"""A device of Linux's input system: gamepad, joystick, 3D mouse.

The layout of events and requests is the kernel's published interface to programs
(linux/input.h), which does not change; it is little enough to speak it here instead
of asking for a library that has to be compiled on the spot.
"""

import os
import struct
import sys
from dataclasses import dataclass, field
from pathlib import Path

from devices.port import DeviceError, DeviceReason

FOLDER = Path("/dev/input")

EV_SYN, EV_KEY, EV_REL, EV_ABS = 0, 1, 2, 3
SYN_DROPPED = 3

EVENT = struct.Struct("@llHHi")
"""One event: seconds, microseconds, kind, code, value."""

_RANGE = struct.Struct("@6i")
_MOST_AXES, _MOST_KEYS = 0x40, 0x300
_CLOCK_MONOTONIC = 1
_EVENTS_AT_ONCE = 64


@dataclass(frozen=True, slots=True)
class InputEvent:
    """One change: which kind of control, which one, its new value."""

    time_s: float
    kind: int
    code: int
    value: int


@dataclass(frozen=True, slots=True)
class AxisRange:
    """What values an absolute axis can take, and how far it may rest off its middle.

    value: that it had when it was asked, None where that is not known.
    """

    low: int
    high: int
    flat: int = 0
    value: int | None = field(default=None, compare=False)

    @property
    def off_middle(self) -> float:
        """Return how far it lay off its middle, 0 to 1; a trigger rests at 1."""
        half = (self.high - self.low) / 2
        if self.value is None or half <= 0:
            return 0.0
        return abs(self.value - (self.high + self.low) / 2) / half


@dataclass(frozen=True, slots=True)
class InputDescription:
    """Which controls a device has, by the kernel's codes."""

    name: str
    absolute: dict[int, AxisRange]
    relative: frozenset[int]
    keys: frozenset[int]


class EventReader:
    """Cut bytes into events, however they arrive."""

    def __init__(self) -> None:
        self._rest = b""

    def feed(self, data: bytes) -> list[InputEvent]:
        """Return the events that are complete now."""
        data = self._rest + data
        whole = len(data) - len(data) % EVENT.size
        self._rest = data[whole:]
        return [
            InputEvent(seconds + micros * 1e-6, kind, code, value)
            for seconds, micros, kind, code, value in EVENT.iter_unpack(data[:whole])
        ]


class InputDevice:
    """An opened device; its events carry the times of the host's monotonic clock."""

    def __init__(self, path: Path) -> None:
        """Open it and ask what it is; DeviceError when that cannot be done."""
        self.path = path
        self._reader = EventReader()
        try:
            self._file = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
        except OSError as error:
            raise DeviceError(
                DeviceReason.NO_PORT,
                f"The input device {path} cannot be opened ({error.strerror}); on most "
                "systems its user must belong to the group 'input'.",
            ) from error
        try:
            self._ask(request_number(1, 0xA0, 4), struct.pack("@i", _CLOCK_MONOTONIC))
            self.description = self._describe()
        except OSError as error:
            self.close()
            raise DeviceError(
                DeviceReason.WRONG_DEVICE,
                f"{path} is no input device ({error.strerror}).",
            ) from error

    def read(self) -> list[InputEvent]:
        """Return what happened since the last time; never waits.

        When the kernel had to drop events, the present state of every control comes
        instead. DeviceError(DISCONNECTED) when the device was unplugged.
        """
        events: list[InputEvent] = []
        try:
            while True:
                data = os.read(self._file, _EVENTS_AT_ONCE * EVENT.size)
                if not data:
                    raise self._gone()
                events += self._reader.feed(data)
        except BlockingIOError:
            pass
        except OSError as error:
            raise self._gone() from error
        for number in range(len(events) - 1, -1, -1):
            if (events[number].kind, events[number].code) == (EV_SYN, SYN_DROPPED):
                return self.state(events[number].time_s) + events[number + 1 :]
        return events

    def state(self, time_s: float) -> list[InputEvent]:
        """Return where every control stands, as events of that moment."""
        try:
            events = [
                InputEvent(time_s, EV_ABS, code, self._axis(code)[0])
                for code in self.description.absolute
            ]
            down = bits(self._ask(request_number(2, 0x18, _MOST_KEYS // 8)))
        except OSError as error:
            raise self._gone() from error
        return events + [
            InputEvent(time_s, EV_KEY, code, int(code in down))
            for code in sorted(self.description.keys)
        ]

    def close(self) -> None:
        """Release the device; harmless when repeated."""
        if self._file >= 0:
            os.close(self._file)
            self._file = -1

    def _describe(self) -> InputDescription:
        name = self._ask(request_number(2, 0x06, 256)).partition(b"\0")[0]
        axes = bits(self._ask(request_number(2, 0x20 + EV_ABS, _MOST_AXES // 8)))
        relative = bits(self._ask(request_number(2, 0x20 + EV_REL, 2)))
        keys = bits(self._ask(request_number(2, 0x20 + EV_KEY, _MOST_KEYS // 8)))
        ranges = {}
        for code in sorted(axes):
            value, low, high, _, flat, _ = self._axis(code)
            ranges[code] = AxisRange(low, high, flat, value)
        return InputDescription(
            name.decode("utf-8", "replace"),
            ranges,
            frozenset(relative),
            frozenset(keys),
        )

    def _axis(self, code: int) -> tuple[int, ...]:
        return _RANGE.unpack(self._ask(request_number(2, 0x40 + code, _RANGE.size)))

    def _ask(self, request: int, data: bytes | None = None) -> bytes:
        # Imported here: the module is there on Unix only.
        import fcntl

        return fcntl.ioctl(self._file, request, data or bytes((request >> 16) & 0x3FFF))

    def _gone(self) -> DeviceError:
        return DeviceError(
            DeviceReason.DISCONNECTED,
            f"The input device {self.path} went away; plug it in again and start anew.",
        )


def input_devices(folder: Path = FOLDER) -> list[Path]:
    """List the input devices of this machine; DeviceError where there can be none."""
    if not sys.platform.startswith("linux"):
        raise DeviceError(
            DeviceReason.NO_PORT,
            "Gamepads are read through Linux's input system; on this system fly with "
            "the mouse.",
        )
    numbered = [path for path in folder.glob("event*") if path.name[5:].isdigit()]
    return sorted(numbered, key=lambda path: int(path.name[5:]))


def request_number(direction: int, number: int, size: int) -> int:
    """Compose the number of a request of type 'E'; 1 writes and 2 reads."""
    return direction << 30 | size << 16 | ord("E") << 8 | number


def bits(mask: bytes) -> set[int]:
    """Return the numbers of the bits that are set, the lowest of each byte first."""
    return {i for i in range(8 * len(mask)) if mask[i // 8] >> (i % 8) & 1}
