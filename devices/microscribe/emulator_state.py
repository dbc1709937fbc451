"""The far end of a MicroScribe line, without input or output.

Received bytes go in with the time and give the bytes that the arm answers. What the
arm measures comes from an ``ArmMotion``; the clock is an argument, so that timer wraps
and timeouts can be tested without waiting. Where the vendor's manual is silent:

* attention: ``IMMC`` in a sliding window, answered once each, all else ignored;
* five seconds after attention without ``BEGIN`` the arm looks for it anew;
* a second without a byte drops an unfinished command;
* writes to the calibration memory are refused and remembered.
"""

from enum import Enum, auto
from typing import Protocol

from devices.microscribe.identity import encode_words
from devices.microscribe.packets import Layout, Packet, encode_packet
from devices.microscribe.profiles import ArmProfile

TICKS_PER_S = 900.0
BEGIN_WAIT_S = 5.0
ARGUMENT_WAIT_S = 1.0

_ATTENTION = b"IMMC"
_BEGIN = b"BEGIN"
_END, _HOME_REFERENCE, _HOME, _SET_RATE = 0xC5, 0xC1, 0xC2, 0xC4
_PARAMETERS, _MAXIMA, _MOTION, _MARKER, _EXTENDED = 0xC0, 0xC6, 0xCF, 0xD2, 0xD3
_MEMORY_WRITES = (0xC3, 0xC7, 0xD0, 0xD1)
_REFUSED = b"\x00"

_CONFIGURATION_BIT = 0x40
_SEVEN_ENCODERS = 0b10


class FarState(Enum):
    """What the arm is listening for."""

    SYNC = auto()
    WAIT_BEGIN = auto()
    IDLE = auto()
    ARGUMENTS = auto()
    PASSWORD = auto()
    MOTION = auto()


_LISTENING = (FarState.SYNC, FarState.WAIT_BEGIN)


class ArmMotion(Protocol):
    """What the arm would measure."""

    def latch(self, now_s: float) -> tuple[tuple[int, ...], int]:
        """Return six counts of 14 bits, then the pedals."""
        ...

    def home(self) -> None:
        """Load the rest pose's counts, wherever the arm stands."""
        ...


class FarEnd:
    """The behaviour of one arm; never raises at anything it hears."""

    def __init__(self, profile: ArmProfile, motion: ArmMotion, power_on_s: float):
        self.state = FarState.SYNC
        self.memory_writes = 0
        """Attempts to rewrite the calibration memory."""
        self.standard_commands = 0
        self._profile = profile
        self._motion = motion
        self._power_on_s = power_on_s
        self._heard_s = power_on_s
        self._window = b""
        self._command = 0
        self._arguments = bytearray()
        self._wanted = 0
        self._stream_layout = Layout(0)
        self._stream_due_s = 0.0
        self._stream_period_s = 0.0
        self._thresholds = b""
        self._sent: tuple[tuple[int, ...], int] = ((0,) * 6, 0)
        self._strings = self._string_replies()

    def receive(self, data: bytes, now_s: float) -> bytes:
        """Take bytes as they come; return the answer."""
        out = bytearray(self.advance(now_s))
        for byte in data:
            self._heard_s = now_s
            out += self._take(byte, now_s)
        return bytes(out)

    def advance(self, now_s: float) -> bytes:
        """Let time pass; return what a motion report sends meanwhile."""
        silence = now_s - self._heard_s
        if self.state is FarState.WAIT_BEGIN and silence > BEGIN_WAIT_S:
            self._listen()
        unfinished = self.state in (FarState.ARGUMENTS, FarState.PASSWORD)
        if unfinished and silence > ARGUMENT_WAIT_S:
            self.state = FarState.IDLE
        if self.state is FarState.MOTION and now_s >= self._stream_due_s:
            return self._report(now_s)
        return b""

    def next_s(self) -> float | None:
        """Return when a motion report is next due, None without one."""
        return self._stream_due_s if self.state is FarState.MOTION else None

    def _listen(self) -> None:
        self.state = FarState.SYNC
        self._window = b""

    def _take(self, byte: int, now_s: float) -> bytes:
        if self.state in _LISTENING:
            return self._take_sign_on(byte)
        if self.state is FarState.ARGUMENTS:
            return self._take_argument(byte, now_s)
        if self.state is FarState.PASSWORD:
            if byte == 0:
                self.state = FarState.IDLE
                return _REFUSED
            return b""
        self.state = FarState.IDLE
        if byte & _CONFIGURATION_BIT:
            return self._configure(byte | 0x80)
        self.standard_commands += 1
        return self._packet(Layout(byte & 0x3F), now_s)

    def _take_sign_on(self, byte: int) -> bytes:
        self._window = (self._window + bytes((byte,)))[-len(_BEGIN) :]
        if self._window.endswith(_ATTENTION):
            self.state = FarState.WAIT_BEGIN
            return _ATTENTION
        if self.state is FarState.WAIT_BEGIN and self._window == _BEGIN:
            self.state = FarState.IDLE
            return self._profile.identity.product_id.encode() + b"\0"
        return b""

    def _configure(self, code: int) -> bytes:
        echo = bytes((code,))
        if code in self._strings:
            return echo + self._strings[code]
        if code == _PARAMETERS:
            block = encode_words(self._profile.dh_words)
            return echo + bytes((len(block),)) + block
        if code == _MAXIMA:
            return echo + self._profile.maxima.encode()
        if code == _EXTENDED and self._profile.identity.has_beta:
            return echo + b"\x02" + encode_words((self._profile.beta_word,))
        if code == _HOME_REFERENCE:
            return echo + bytes(12)
        if code == _HOME:
            self._motion.home()
            return echo
        if code == _END:
            self._listen()
            return echo
        if code in _MEMORY_WRITES:
            self.memory_writes += 1
            self.state = FarState.PASSWORD
            return echo
        if code in (_SET_RATE, _MOTION, _MARKER):
            self._command, self._wanted = code, 24 if code == _MOTION else 1
            self._arguments.clear()
            self.state = FarState.ARGUMENTS
        return b""

    def _take_argument(self, byte: int, now_s: float) -> bytes:
        self._arguments.append(byte)
        if self._command == _MOTION and len(self._arguments) == 3:
            self._wanted = 26 if byte & 0b11 == _SEVEN_ENCODERS else 24
        if len(self._arguments) < self._wanted:
            return b""
        self.state = FarState.IDLE
        if self._command == _MARKER:
            return bytes(self._arguments)
        if self._command == _MOTION:
            self._begin_report(now_s)
        # A pseudo-terminal has the client's rate; there is nothing to switch.
        return bytes((self._command,))

    def _begin_report(self, now_s: float) -> None:
        period = int.from_bytes(self._arguments[:2], "big")
        self._stream_layout = Layout(self._arguments[2] & 0x3F)
        self._stream_period_s = period / TICKS_PER_S
        self._thresholds = bytes(self._arguments[3:])
        self._sent = self._motion.latch(now_s)
        self._stream_due_s = now_s
        self.state = FarState.MOTION

    def _report(self, now_s: float) -> bytes:
        # Ten bits a byte at the fastest rate: what "back to back" means on the line.
        shortest = self._stream_layout.length / 11520.0
        period = max(self._stream_period_s, shortest)
        self._stream_due_s = max(self._stream_due_s + period, now_s - period)
        if any(self._thresholds) and not self._triggered(now_s):
            return b""
        return self._packet(self._stream_layout, now_s)

    def _triggered(self, now_s: float) -> bool:
        counts, buttons = self._motion.latch(now_s)
        if (buttons ^ self._sent[1]) & self._thresholds[0]:
            return True
        for i, (new, old) in enumerate(zip(counts, self._sent[0], strict=True)):
            limit = int.from_bytes(self._thresholds[9 + 2 * i : 11 + 2 * i], "big")
            moved = abs((new - old + 8192) % 16384 - 8192)
            if limit and moved >= limit:
                return True
        return False

    def _packet(self, layout: Layout, now_s: float) -> bytes:
        counts, buttons = self._sent = self._motion.latch(now_s)
        ticks = int((now_s - self._power_on_s) * TICKS_PER_S)
        return encode_packet(
            Packet(
                command=layout.command,
                buttons=buttons,
                timer=ticks % (self._profile.maxima.timer + 1),
                analog=self._profile.maxima.analog,
                counts=(*counts, 0),
            )
        )

    def _string_replies(self) -> dict[int, bytes]:
        about = self._profile.identity
        texts = (
            about.product_name,
            about.product_id,
            about.model,
            about.serial,
            about.comment,
            about.parameter_format,
            about.firmware,
        )
        return {0xC8 + i: text.encode() + b"\0" for i, text in enumerate(texts)}
