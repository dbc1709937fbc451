"""An emulated arm inside this process, with a clock that a test moves.

No terminal, no thread, no sleeping: reading with a timeout moves the clock. ::

    arm = EmulatedArm(DX40937, StillMotion(DX40937), faults=[parse_fault("f8@2")])
    line = MemoryLine(arm)                  # line.clock is a DrivenClock at 0 s
    port = line.open_serial(timeout=0.1)    # what a pyserial client expects ...
    port.write(b"\\xc5IMMC")
    assert port.read(4) == b"IMMC"          # line.clock.now() is now about 1.9 ms
    line.clock.sleep(18.3)                  # the timer wraps meanwhile
    byte_port = line.open_port()            # ... or a BytePort for our own driver

``arm`` is scripted by its methods, such as ``arm.unplug(line.clock.now())``. With
``HostClock`` the same line runs in real time; then, and only then, several threads
may use it.
"""

import errno
import math
import threading

from devices.microscribe.driver.driver import SerialPort
from devices.microscribe.emulator.emulated_arm import EmulatedArm
from devices.port import Closing, DeviceError, DeviceReason, HostClock
from system import UserError


class DrivenClock:
    """A clock that stands still until somebody moves it."""

    def __init__(self, now_s: float = 0.0) -> None:
        self._now_s = now_s

    def now(self) -> float:
        """Return the time now."""
        return self._now_s

    def sleep(self, seconds: float) -> None:
        """Move the clock on."""
        if seconds < 0.0:
            raise UserError(f"time does not go back, got {seconds} s")
        self._now_s += seconds

    def sleep_until(self, time_s: float) -> None:
        """Move the clock to ``time_s`` unless it is there already."""
        self._now_s = max(self._now_s, time_s)


class MemoryLine:
    """An emulated arm and the clock it lives by; opens ports to it."""

    def __init__(
        self, arm: EmulatedArm, clock: DrivenClock | HostClock | None = None
    ) -> None:
        self.arm = arm
        self.clock = DrivenClock() if clock is None else clock
        self.changed = threading.Condition(threading.RLock())

    @property
    def name(self) -> str:
        """Return the port's name; another one after every replugging."""
        return f"memory:{self.arm.generation}"

    def open_serial(
        self, baudrate: int = 115200, timeout: float | None = None
    ) -> "MemorySerial":
        """Open the port as pyserial would; OSError while the plug is out."""
        with self.changed:
            self.arm.pass_time(self.clock.now())
        return MemorySerial(self, baudrate, timeout)

    def open_port(self) -> SerialPort:
        """Open the port as our own driver does; DeviceError while the plug is out."""
        try:
            return SerialPort(self.name, self.open_serial())
        except OSError as error:
            raise DeviceError(
                DeviceReason.NO_PORT, f"The port {self.name} is not there."
            ) from error

    def rest_until(self, time_s: float) -> None:
        """Let time pass until ``time_s`` or, in real time, until something changes."""
        if isinstance(self.clock, DrivenClock):
            if time_s == math.inf:
                raise TimeoutError(
                    "this read would never end: nothing is on its way, and it has no "
                    "timeout"
                )
            self.clock.sleep_until(time_s)
        else:
            wait_s = max(0.0, time_s - self.clock.now())
            self.changed.wait(min(wait_s, threading.TIMEOUT_MAX))


class MemorySerial(Closing):
    """What clients use of ``serial.Serial``; raises OSError once unplugged."""

    def __init__(self, line: MemoryLine, baudrate: int, timeout: float | None) -> None:
        self.baudrate = baudrate
        self.timeout = timeout
        self.inter_byte_timeout: float | None = None
        self.is_open = True
        self._line = line
        self._generation = line.arm.generation
        self.name = self.port = line.name
        """The name under which it was opened."""
        self._arrived = bytearray()
        self._check()

    @property
    def in_waiting(self) -> int:
        """Return how many bytes can be read at once."""
        with self._line.changed:
            self._collect()
            self._check()
            return len(self._arrived)

    def read(self, size: int = 1) -> bytes:
        """Return up to ``size`` bytes, fewer when a timeout ends first."""
        line, had = self._line, 0
        with line.changed:
            until = quiet = math.inf
            if self.timeout is not None:
                until = line.clock.now() + self.timeout
            while True:
                self._collect()
                if len(self._arrived) >= size:
                    break
                self._check()
                now_s = line.clock.now()
                if self.inter_byte_timeout is not None and len(self._arrived) > had:
                    had, quiet = len(self._arrived), now_s + self.inter_byte_timeout
                if now_s >= min(until, quiet):
                    break
                arriving_s = line.arm.next_s()
                due_s = math.inf if arriving_s is None else arriving_s
                line.rest_until(min(until, quiet, due_s))
            data = bytes(self._arrived[:size])
            del self._arrived[:size]
            return data

    def write(self, data: bytes) -> int:
        """Hand ``data`` to the arm; return how many bytes that were."""
        with self._line.changed:
            self._check()
            self._collect()
            self._line.arm.hear(bytes(data), self._line.clock.now(), self.baudrate)
            self._line.changed.notify_all()
        return len(data)

    def reset_input_buffer(self) -> None:
        """Drop what has arrived unread."""
        with self._line.changed:
            self._collect()
            self._check()
            self._arrived.clear()

    def reset_output_buffer(self) -> None:
        """Do nothing: what was written has been heard."""

    def flush(self) -> None:
        """Do nothing: what was written has been heard."""

    def close(self) -> None:
        """Let go of the port; the arm keeps its session, as a real one would."""
        self.is_open = False

    def _collect(self) -> None:
        arm = self._line.arm
        if self.is_open and self._generation == arm.generation:
            self._arrived += arm.speak(self._line.clock.now(), self.baudrate)

    def _check(self) -> None:
        arm = self._line.arm
        here = arm.plugged and self._generation == arm.generation
        if not (self.is_open and here):
            raise OSError(errno.EIO, "the port is closed or has gone", self.name)
