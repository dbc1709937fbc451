"""A MicroScribe arm on a serial port, as a source of poses.

One background thread owns the port. It polls at a fixed rate, which measures the arm
at even times whatever a USB adapter does to the arrival of bytes.
"""

import atexit
import os
import sys
import threading
import time
from collections import deque
from collections.abc import Iterator
from types import TracebackType
from typing import Self

import serial

from devices.microscribe.link import RATES, ArmDescription, ArmLink, LinkTiming
from devices.microscribe.sampler import ArmSampler, HomeState
from devices.port import BytePort, DeviceError, DeviceReason
from devices.pose import Pose

# pyserial lets errors of the terminal itself pass through untranslated.
_PORT_ERRORS: tuple[type[Exception], ...] = (OSError,)
if sys.platform != "win32":
    import termios

    _PORT_ERRORS = (OSError, termios.error)

# A name with a NUL in it is a ValueError.
_OPEN_ERRORS = (*_PORT_ERRORS, ValueError)

# Twice the rate of a recorded path would bring nothing; the line carries 430 Hz.
POLL_HZ = 100.0

# Almost three minutes at 100 Hz: a consumer further behind is not going to catch up.
LARGEST_QUEUE = 1 << 14

# Longer than the search for a lost line takes, which then says so itself.
SILENCE_S = 15.0


class SerialPort:
    """A serial port by pyserial: 8 data bits, no parity, 1 stop bit, exclusive."""

    def __init__(self, name: str) -> None:
        try:
            self._serial = serial.Serial(name, RATES[0], exclusive=True, timeout=0.0)
        except _OPEN_ERRORS as error:
            raise DeviceError(
                DeviceReason.NO_PORT,
                f"The serial port {name} cannot be opened ({_cause(error)}); check its "
                "name, its permissions and that no other program uses it.",
            ) from error
        self._name = name

    @property
    def name(self) -> str:
        """Get the name of the port in the operating system."""
        return self._name

    def read(self, count: int, timeout_s: float) -> bytes:
        """Return up to ``count`` bytes, fewer when the timeout ends first."""
        try:
            self._serial.timeout = max(timeout_s, 0.0)
            return bytes(self._serial.read(count))
        except _PORT_ERRORS as error:
            raise self._gone() from error

    def write(self, data: bytes) -> None:
        """Hand all of ``data`` to the line."""
        try:
            self._serial.write(data)
        except _PORT_ERRORS as error:
            raise self._gone() from error

    def reset_input(self) -> int:
        """Drop what has arrived unread; return how many bytes that was."""
        try:
            return len(self._serial.read(self._serial.in_waiting))
        except _PORT_ERRORS as error:
            raise self._gone() from error

    def set_rate(self, baud: int) -> None:
        """Change the bit rate of both directions."""
        try:
            self._serial.baudrate = baud
        except _PORT_ERRORS as error:
            raise self._gone() from error

    def close(self) -> None:
        """Release the port; harmless when repeated."""
        self._serial.close()

    def _gone(self) -> DeviceError:
        return DeviceError(
            DeviceReason.DISCONNECTED,
            f"The device on {self._name} went away; plug it in again and start anew.",
        )


class MicroScribe:
    """A MicroScribe arm that yields poses in its own frame, mm.

    ``read`` and iteration give every pose once and in order; ``latest`` gives the
    newest for a live picture. The two do not disturb one another. Poses come from
    whole packets only; a packet has no checksum, so a bit flipped on the line that
    moves the arm by less than a hand could is not noticed.

    ``port`` is a port's name or an opened port. With ``baud`` only that rate is
    tried. ``assume_home`` states that the arm stood in its rest when it was switched
    on; without it poses are refused until ``home`` was called.
    """

    def __init__(
        self,
        port: str | BytePort,
        *,
        baud: int | None = None,
        poll_hz: float = POLL_HZ,
        assume_home: bool = True,
        timing: LinkTiming | None = None,
    ) -> None:
        if not poll_hz > 0.0:
            raise ValueError(f"poll_hz must be positive, got {poll_hz}")
        self._period_s = 1.0 / poll_hz
        self._stop = threading.Event()
        self._changed = threading.Condition()
        self._poses: deque[Pose] = deque()
        self._latest: Pose | None = None
        self._lost = 0
        self._error: Exception | None = None
        self._home_wanted = False
        self._port = SerialPort(port) if isinstance(port, str) else port
        self._link = ArmLink(self._port, timing)
        try:
            self._sampler = ArmSampler(
                self._link, RATES if baud is None else (baud,), assume_home
            )
        except BaseException:
            self._release()
            raise
        self._thread = threading.Thread(target=self._run, name="microscribe")
        # A forgotten arm must not keep the interpreter; atexit still ends its session.
        self._thread.daemon = True
        self._thread.start()
        atexit.register(self.close)

    @property
    def description(self) -> ArmDescription:
        """Get what the arm told about itself."""
        return self._sampler.description

    @property
    def home_state(self) -> HomeState:
        """Get whether the arm's angle registers can be trusted."""
        return self._sampler.home_state

    @property
    def counters(self) -> dict[str, int]:
        """Get what went wrong on the line so far, by name."""
        packets = self._link.session.counters
        return {
            "packets": packets.packets,
            "framing": packets.framing,
            "noise": packets.noise,
            "stray": self._link.session.stray,
            "missed": self._sampler.missed,
            "recoveries": self._sampler.recoveries,
            "refused": self._sampler.tracker.refused,
            "jumps": self._sampler.tracker.jumps,
        }

    def read(self, timeout_s: float) -> Pose:
        """Return the next pose, none lost.

        Raise TimeoutError when none came in time, EOFError after ``close``,
        DeviceError when the device failed and DeviceError(OVERRUN) when more than
        16384 poses were left unread. Poses measured before a failure come first.
        """
        with self._changed:
            self._confess()
            self._changed.wait_for(
                lambda: self._poses or self._error or self._stop.is_set(), timeout_s
            )
            if self._poses:
                return self._poses.popleft()
            self._refuse()
        raise TimeoutError(f"no pose came within {timeout_s:g} s")

    def drain(self) -> list[Pose]:
        """Return every pose that is waiting, oldest first; raise as ``read`` does."""
        with self._changed:
            self._confess()
            if not self._poses:
                self._refuse()
            poses = list(self._poses)
            self._poses.clear()
            return poses

    def latest(self) -> Pose | None:
        """Return the newest pose, None before the first; raise if the device failed."""
        with self._changed:
            self._refuse()
            return self._latest

    def pose_age_s(self) -> float:
        """Return seconds since the newest pose's header arrived, inf before it."""
        with self._changed:
            if self._latest is None:
                return float("inf")
            return time.monotonic() - self._latest.host_time_s

    def home(self) -> None:
        """Load the rest counts; the arm must stand in its rest now."""
        with self._changed:
            self._home_wanted = True
            self._changed.wait_for(
                lambda: not self._home_wanted or self._error or self._stop.is_set()
            )
            self._refuse()

    def close(self) -> None:
        """End the session and release the port; harmless when repeated."""
        self._stop.set()
        if self._thread is not threading.current_thread():
            self._thread.join()
        atexit.unregister(self.close)

    def __iter__(self) -> Iterator[Pose]:
        """Iterate over poses until the arm is closed; raise if it fails."""
        try:
            while True:
                yield self.read(SILENCE_S)
        except EOFError:
            return

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def _confess(self) -> None:
        if self._lost:
            lost, self._lost = self._lost, 0
            raise DeviceError(
                DeviceReason.OVERRUN,
                f"{lost} poses were lost because nobody read them in time.",
            )

    def _refuse(self) -> None:
        if self._error is not None:
            raise self._error
        if self._stop.is_set():
            raise EOFError(f"the arm on {self._port.name} was closed")
        if self.home_state is HomeState.UNKNOWN:
            raise DeviceError(
                DeviceReason.NOT_HOMED,
                f"The arm on {self._port.name} may stand elsewhere than it believes; "
                "put it into its rest and home it.",
            )

    def _run(self) -> None:
        try:
            due = time.monotonic()
            while not self._stop.is_set():
                self._step()
                # After a stall the missed polls are gone; nobody wants them at once.
                due = max(due + self._period_s, time.monotonic() - self._period_s)
                self._stop.wait(max(0.0, due - time.monotonic()))
        except Exception as error:
            # Nobody sees what a thread raises; the reader of the poses must.
            self._error = error
        finally:
            self._release()
            with self._changed:
                self._changed.notify_all()

    def _step(self) -> None:
        home_wanted = self._home_wanted
        if home_wanted:
            self._sampler.home()
        pose = self._sampler.next_pose()
        with self._changed:
            if home_wanted:
                self._home_wanted = False
            if pose is not None:
                if len(self._poses) == LARGEST_QUEUE:
                    self._poses.popleft()
                    self._lost += 1
                self._poses.append(pose)
                self._latest = pose
            self._changed.notify_all()

    def _release(self) -> None:
        try:
            self._link.end()
        except DeviceError as error:
            # What made the session fail is the better story than this echo of it.
            if self._error is None and error.reason is not DeviceReason.DISCONNECTED:
                self._error = error
        finally:
            self._port.close()


def _cause(error: Exception) -> str:
    number = getattr(error, "errno", None)
    return os.strerror(number) if number else str(error)
