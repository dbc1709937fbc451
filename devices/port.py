"""What a byte port must do, the clock beside it, and what is closed at the end."""

import time
from abc import ABC, abstractmethod
from enum import Enum
from types import TracebackType
from typing import Protocol, Self


class Closing(ABC):
    """Close at the end of a ``with``, whatever ended it."""

    @abstractmethod
    def close(self) -> None:
        """End; harmless when repeated."""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()


class DeviceReason(Enum):
    """Why a device failed; the text says it to a person."""

    NO_PORT = "the port cannot be opened"
    NO_DEVICE = "nothing answered on the port"
    CANT_BEGIN = "the device answered but did not begin a session"
    WRONG_DEVICE = "another kind of device answered"
    UNSUPPORTED_FORMAT = "the device describes itself in an unknown format"
    BAD_REPLY = "the device answered something that is no valid reply"
    CONSTANTS = "the device's constants cannot be trusted"
    NOT_HOMED = "the device may not have been homed"
    DISCONNECTED = "the device went away"
    GARBAGE = "the line delivers bytes that are no packets"
    LOOPBACK = "the port returns our own bytes"
    OVERRUN = "poses were not read in time"
    OUT_OF_REACH = "the tool is where no hand can be"


class DeviceError(Exception):
    """A device misbehaved; ``reason`` says how, the text says it in one sentence."""

    def __init__(self, reason: DeviceReason, message: str) -> None:
        super().__init__(message)
        self.reason = reason


class Clock(Protocol):
    """Seconds that never run backwards, and a way to let some of them pass."""

    def now(self) -> float:
        """Return seconds since some moment."""
        ...

    def sleep(self, seconds: float) -> None:
        """Return after that time."""
        ...


class HostClock:
    """The host's monotonic clock."""

    def now(self) -> float:
        """Return seconds since some moment."""
        return time.monotonic()

    def sleep(self, seconds: float) -> None:
        """Return after that time."""
        time.sleep(seconds)


class BytePort(Protocol):
    """A serial line, or anything that behaves like one.

    Every method raises DeviceError(DISCONNECTED) once the far end is gone.
    """

    name: str
    """Under which a person knows the port."""

    @property
    def waiting(self) -> int:
        """Return how many bytes have arrived unread."""
        ...

    def read(self, count: int, timeout_s: float, quiet_s: float | None = None) -> bytes:
        """Return up to ``count`` bytes, fewer when the timeout ends first.

        Or when the line falls quiet for ``quiet_s`` after a byte, where that is given.
        """
        ...

    def read_some(self, least: int, timeout_s: float) -> bytes:
        """Return all there is once ``least`` bytes are; fewer after the timeout."""
        ...

    def write(self, data: bytes) -> None:
        """Hand all of ``data`` to the line."""
        ...

    def reset_input(self) -> int:
        """Drop what has arrived unread; return how many bytes that was."""
        ...

    def set_rate(self, baud: int) -> None:
        """Change the bit rate of both directions."""
        ...

    def close(self) -> None:
        """Release the port; harmless when repeated."""
        ...
