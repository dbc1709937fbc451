"""A MicroScribe arm on a serial port, as a source of poses.

One background thread owns the port. It polls at a fixed rate, or lets the arm report
its motion by itself, and gives every pose the host's time of its tick.
"""

import atexit
import errno
import os
from collections.abc import Sequence
from typing import Any

import serial
from serial.tools import list_ports

from devices.microscribe.driver.arm_thread import ArmThread
from devices.microscribe.driver.sampler import HomeState, MotionReports
from devices.microscribe.driver.supervisor import (
    POLL_HZ,
    ArmSettings,
    ConnectionSupervisor,
    PortFinder,
    Presence,
)
from devices.microscribe.wire.line import LinkTiming
from devices.microscribe.wire.link import ArmDescription
from devices.microscribe.wire.sign_on import RATES
from devices.microscribe.wire.terminal_file import (
    TERMINAL_ERRORS,
    TERMINALS_ARE_FILES,
    SocketFile,
    TerminalFile,
)
from devices.port import BytePort, DeviceError, DeviceReason
from devices.serial_adapters import absence_remedy, permission_remedy
from devices.source import QueuedSource
from system import UserError

# A name with a NUL in it is a ValueError.
_OPEN_ERRORS: tuple[type[Exception], ...] = (*TERMINAL_ERRORS, ValueError)

# Longer than the search for a lost line takes, which then says so itself.
SILENCE_S = 15.0


class SerialPort:
    """A serial port by pyserial: 8 data bits, no parity, 1 stop bit, exclusive.

    A name with a scheme is what pyserial makes of it: ``socket://host:port`` is an arm
    at the far end of a network.
    """

    def __init__(self, name: str, opened: Any = None) -> None:
        """Open it, or take over what does as pyserial's; DeviceError if not to be."""
        try:
            self._serial: Any = opened or _opened(name)
        except _OPEN_ERRORS as error:
            raise DeviceError(
                DeviceReason.NO_PORT,
                f"The serial port {name} cannot be opened ({_cause(error)}); "
                f"{_port_remedy(name, error)}.",
            ) from error
        self.name = name
        self._file: TerminalFile | None = None
        if name.startswith("socket://"):
            self._file = SocketFile(self._serial.fileno())
        elif opened is None and TERMINALS_ARE_FILES:
            self._file = TerminalFile(self._serial.fileno())
        self.set_rate(RATES[0])

    @property
    def waiting(self) -> int:
        """Return how many bytes have arrived unread."""
        try:
            if self._file is not None:
                return self._file.waiting
            return int(self._serial.in_waiting)
        except TERMINAL_ERRORS as error:
            raise self._gone() from error

    def read(self, count: int, timeout_s: float, quiet_s: float | None = None) -> bytes:
        """Return up to ``count`` bytes, fewer when a wait ends first."""
        quiet_s = timeout_s if quiet_s is None else quiet_s
        try:
            if self._file is not None:
                return self._file.read(count, timeout_s, quiet_s)
            self._serial.inter_byte_timeout = quiet_s
            self._serial.timeout = max(timeout_s, 0.0)
            return bytes(self._serial.read(count))
        except TERMINAL_ERRORS as error:
            raise self._gone() from error

    def read_some(self, least: int, timeout_s: float) -> bytes:
        """Return all there is once ``least`` bytes are; fewer after the timeout."""
        try:
            if self._file is not None:
                return self._file.read_some(least, timeout_s)
            count = max(least, int(self._serial.in_waiting))
            return self.read(count, timeout_s)
        except TERMINAL_ERRORS as error:
            raise self._gone() from error

    def write(self, data: bytes) -> None:
        """Hand all of ``data`` to the line."""
        try:
            sent = 0 if self._file is None else self._file.write(data)
            if sent < len(data):
                self._serial.write(data[sent:])
        except TERMINAL_ERRORS as error:
            raise self._gone() from error

    def reset_input(self) -> int:
        """Drop what has arrived unread; return how many bytes that was."""
        return len(self.read(self.waiting, 0.0))

    def set_rate(self, baud: int) -> None:
        """Change the bit rate of both directions."""
        try:
            self._serial.baudrate = baud
        except TERMINAL_ERRORS as error:
            raise self._gone() from error
        if self._file is not None:
            self._file.byte_s = 10.0 / baud

    def close(self) -> None:
        """Release the port; harmless when repeated."""
        if self._file is not None:
            self._file.forget()
        self._serial.close()

    def _gone(self) -> DeviceError:
        return DeviceError(
            DeviceReason.DISCONNECTED,
            f"The device on {self.name} went away; plug it in again.",
        )


class SerialPorts:
    """The serial ports of this machine."""

    def names(self) -> Sequence[str]:
        """Return the ports that are plugged in."""
        return [str(port.device) for port in list_ports.comports()]

    def open(self, name: str) -> SerialPort:
        """Open a port; raise DeviceError if that cannot be."""
        return SerialPort(name)


class SupervisedArm:
    """What an arm shows of itself while a supervisor keeps its session."""

    _supervisor: ConnectionSupervisor

    @property
    def description(self) -> ArmDescription:
        """Return what the arm told about itself."""
        return self._supervisor.sampler.description

    @property
    def home_state(self) -> HomeState:
        """Return whether the arm's angle registers can be trusted."""
        return self._supervisor.sampler.home_state

    @property
    def presence(self) -> Presence:
        """Return whether the arm can be spoken to."""
        return self._supervisor.presence

    @property
    def trouble(self) -> DeviceError | None:
        """Return why the arm is lost, None while it is there."""
        return self._supervisor.trouble

    @property
    def frozen_joints(self) -> tuple[int, ...]:
        """Return the joints, from 0, whose encoders stood still while others moved."""
        return self._supervisor.sampler.tracker.watch.frozen

    @property
    def counts(self) -> tuple[int, ...]:
        """Return the newest counts of the six joints, continued over their wraps."""
        return self._supervisor.sampler.tracker.counts

    @property
    def baud(self) -> int:
        """Return the rate at which the arm was found, bits per second."""
        return self._supervisor.link.baud

    @property
    def round_trip_s(self) -> float:
        """Return the median time from a poll to its whole answer, nan before the first.

        Of the newest polls; a stream has none.
        """
        return self._supervisor.link.round_trip_s

    @property
    def clock_drift(self) -> float:
        """Return how much faster the host's clock runs than the arm's, s per s."""
        return self._supervisor.sampler.tracker.alignment.drift

    @property
    def counters(self) -> dict[str, int]:
        """Return what went wrong on the line so far, by name."""
        return self._supervisor.counters


class MicroScribe(SupervisedArm, QueuedSource):
    """A MicroScribe arm that yields poses in its own frame, mm.

    ``read`` and iteration give every pose once and in order; ``latest`` gives the
    newest for a live picture. The two do not disturb one another. Poses come from
    whole packets only; a packet has no checksum, so a bit flipped on the line that
    moves the arm by less than a hand could is not noticed.

    ``port`` is a port's name or an opened port. With ``baud`` only that rate is
    tried. ``assume_home`` states that the arm stood in its rest when it was switched
    on; without it poses are refused until ``home`` was called. ``reports`` lets the
    arm send by itself instead of being polled ``poll_hz`` times a second.

    With ``replug``, usually ``SerialPorts()``, a lost arm is looked for until it is
    there again. ``read`` then raises the loss once and goes on waiting, ``latest``
    keeps its last pose, whose age grows.
    """

    _silence_s = SILENCE_S

    def __init__(
        self,
        port: str | BytePort,
        *,
        baud: int | None = None,
        poll_hz: float = POLL_HZ,
        reports: MotionReports | None = None,
        assume_home: bool = True,
        timing: LinkTiming | None = None,
        replug: PortFinder | None = None,
    ) -> None:
        if not poll_hz > 0.0:
            raise UserError(f"poll_hz must be positive, got {poll_hz}")
        settings = ArmSettings(
            rates=RATES if baud is None else (baud,),
            poll_hz=poll_hz,
            reports=reports,
            assume_home=assume_home,
            timing=timing,
        )
        opened = SerialPort(port) if isinstance(port, str) else port
        self._supervisor = ConnectionSupervisor(opened, settings, replug)
        self._thread = ArmThread(self._supervisor)
        self._queue = self._thread.queue
        atexit.register(self.close)

    def home(self) -> None:
        """Load the rest counts; the arm must stand in its rest now."""
        self._thread.home()

    def close(self) -> None:
        """End the session and release the port; harmless when repeated."""
        self._thread.stop()
        atexit.unregister(self.close)


def _opened(name: str) -> Any:
    if "://" in name:
        return serial.serial_for_url(name, RATES[0], timeout=0.0)
    return serial.Serial(name, RATES[0], exclusive=True, timeout=0.0)


def _port_remedy(name: str, error: Exception) -> str:
    """Return what to do where a port cannot be opened."""
    number = getattr(error, "errno", None)
    if number in (errno.EACCES, errno.EPERM):
        return permission_remedy(name)
    if number in (errno.ENOENT, errno.ENODEV, errno.ENXIO) and "://" not in name:
        return absence_remedy(SerialPorts().names())
    if number in (errno.EBUSY, errno.EAGAIN):
        return "another program uses it; end that one first"
    return "check its name, its permissions and that no other program uses it"


def _cause(error: Exception) -> str:
    number = getattr(error, "errno", None)
    return os.strerror(number) if number else str(error)
