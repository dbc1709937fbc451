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

from devices.microscribe.emulator.answer import PARAMETERS, Answer, AnswerKind, describe
from devices.microscribe.emulator.packet import (
    ARGUMENTS,
    ARGUMENTS_OF_SEVEN,
    TICKS_PER_S,
    MotionReport,
    Reading,
    packet_length,
    standard_packet,
)
from devices.microscribe.kinematics.profiles import ArmProfile
from system import UserError

BEGIN_WAIT_S = 5.0
ARGUMENT_WAIT_S = 1.0

FASTEST_RATE = 115200
ROUNDING_TICKS = 1e-6
BITS_PER_BYTE = 10.0

_ATTENTION = b"IMMC"
_BEGIN = b"BEGIN"
_END, _HOME, _SET_RATE, _MOTION, _MARKER = 0xC5, 0xC2, 0xC4, 0xCF, 0xD2
_SET_PARAMETERS = 0xC7
# Commands that write the calibration memory, with the arguments they would take.
_MEMORY_WRITES = {0xC3: 14, _SET_PARAMETERS: 36, 0xD0: 14, 0xD1: 0}
_GRANTED, _REFUSED = b"\xff", b"\x00"

_CONFIGURATION_BIT = 0x40
_PRESCALER = (1, 3, 4, 13)


class FirmwareState(Enum):
    """What the arm is listening for."""

    SYNC = auto()
    WAIT_BEGIN = auto()
    IDLE = auto()
    ARGUMENTS = auto()
    PASSWORD = auto()
    MOTION = auto()


_LISTENING = (FirmwareState.SYNC, FirmwareState.WAIT_BEGIN)


class ArmMotion(Protocol):
    """What the arm would measure."""

    def latch(self, now_s: float) -> tuple[tuple[int, ...], int]:
        """Return six counts of 14 bits, then the pedals."""
        ...

    def home(self) -> None:
        """Load the rest pose's counts, wherever the arm stands."""
        ...


class ArmFirmware:
    """The behaviour of one arm; never raises at anything it hears.

    ``sync_repeats`` is how often it must hear IMMC before the first echo; real ones
    are said to want three to six. With ``accepts_memory_writes`` the right password
    is granted and new parameters are kept until the power goes.
    """

    def __init__(
        self,
        profile: ArmProfile,
        motion: ArmMotion,
        power_on_s: float,
        *,
        sync_repeats: int = 1,
        accepts_memory_writes: bool = False,
    ) -> None:
        if sync_repeats < 1:
            raise UserError(f"sync_repeats must be 1 or more, got {sync_repeats}")
        self.memory_writes = 0
        """Attempts to rewrite the calibration memory."""
        self.standard_commands = 0
        self.asked_rate: int | None = None
        """The rate that a client asked for by a command; the line clears it."""
        self.byte_s = BITS_PER_BYTE / FASTEST_RATE
        """What one byte takes; packets back to back are this dense."""
        self._profile = profile
        self._motion = motion
        self._sync_repeats = sync_repeats
        self._accepts = accepts_memory_writes
        self._arguments = bytearray()
        self._command = 0
        self._wanted = 0
        self._window = b""
        self.power_on(power_on_s)

    def power_on(self, now_s: float) -> None:
        """Begin anew: timer at zero, no session, constants as they were made."""
        self.state = FirmwareState.SYNC
        self.homed = not self._profile.needs_home_button
        """Whether it measures at all."""
        self.timer_zero_s = now_s
        self._attentions = 0
        self._heard_s = self._attention_s = now_s
        self._report: MotionReport | None = None
        self._description = describe(self._profile)

    def receive(self, data: bytes, now_s: float) -> bytes:
        """Take bytes as they come; return the answer."""
        return b"".join(answer.data for answer in self.answers(data, now_s))

    def answers(self, data: bytes, now_s: float) -> list[Answer]:
        """Take bytes as they come; return the answers one by one."""
        out = self.pass_time(now_s)
        for byte in data:
            self._heard_s = now_s
            answer = self._take(byte, now_s)
            if answer is not None:
                out.append(answer)
        return out

    def advance(self, now_s: float) -> bytes:
        """Let time pass; return what a motion report sends meanwhile."""
        return b"".join(answer.data for answer in self.pass_time(now_s))

    def pass_time(self, now_s: float) -> list[Answer]:
        """Let time pass; return the packet that a motion report sends now, if any."""
        if self.state is FirmwareState.WAIT_BEGIN:
            if now_s - self._attention_s > BEGIN_WAIT_S:
                self._listen()
        elif self.state in (FirmwareState.ARGUMENTS, FirmwareState.PASSWORD):
            if now_s - self._heard_s > ARGUMENT_WAIT_S:
                self.state = FirmwareState.IDLE
        elif self.state is FirmwareState.MOTION and self._report is not None:
            due = now_s >= self._report.due_s
            return self._send_report(self._report, now_s) if due else []
        return []

    def next_s(self) -> float | None:
        """Return when a motion report is next due, None without one."""
        if self.state is FirmwareState.MOTION and self._report is not None:
            return self._report.due_s
        return None

    def _listen(self) -> None:
        self.state = FirmwareState.SYNC
        self._window, self._attentions = b"", 0

    def _take(self, byte: int, now_s: float) -> Answer | None:
        if self.state in _LISTENING:
            return self._take_sign_on(byte, now_s)
        if self.state is FirmwareState.ARGUMENTS:
            return self._take_argument(byte, now_s)
        if self.state is FirmwareState.PASSWORD:
            return self._take_password(byte)
        self.state = FirmwareState.IDLE
        if byte & _CONFIGURATION_BIT:
            return self._configure(byte | 0x80)
        self.standard_commands += 1
        return self._packet(byte, self._read(now_s), now_s)

    def _take_sign_on(self, byte: int, now_s: float) -> Answer | None:
        self._window = (self._window + bytes((byte,)))[-len(_BEGIN) :]
        if self._window.endswith(_ATTENTION):
            self._attentions += 1
            if self._attentions < self._sync_repeats:
                return None
            self.state, self._attention_s = FirmwareState.WAIT_BEGIN, now_s
            return Answer(AnswerKind.ATTENTION, _ATTENTION)
        if self.state is FirmwareState.WAIT_BEGIN and self._window == _BEGIN:
            self.state = FirmwareState.IDLE
            product = self._profile.identity.product_id.encode() + b"\0"
            return Answer(AnswerKind.PRODUCT_ID, product)
        return None

    def _take_password(self, byte: int) -> Answer | None:
        """Collect up to the NUL; say whether it is this arm's serial number."""
        if byte:
            self._arguments.append(byte)
            return None
        right = bytes(self._arguments) == self._profile.identity.serial.encode()
        self._arguments.clear()
        self.state = FirmwareState.IDLE
        if not (self._accepts and right):
            return Answer(AnswerKind.PASSWORD, _REFUSED)
        self._wanted = _MEMORY_WRITES[self._command]
        if self._wanted:
            self.state = FirmwareState.ARGUMENTS
        return Answer(AnswerKind.PASSWORD, _GRANTED)

    def _configure(self, code: int) -> Answer | None:
        if code in self._description:
            return self._description[code]
        echo = Answer(AnswerKind.ECHO, bytes((code,)))
        if code == _HOME:
            self._motion.home()
            return echo
        if code == _END:
            self._listen()
            return echo
        if code in _MEMORY_WRITES:
            self.memory_writes += 1
            self._command = code
            self._arguments.clear()
            self.state = FirmwareState.PASSWORD
            return echo
        if code in (_SET_RATE, _MOTION, _MARKER):
            self._command, self._wanted = code, ARGUMENTS if code == _MOTION else 1
            self._arguments.clear()
            self.state = FirmwareState.ARGUMENTS
        return None

    def _take_argument(self, byte: int, now_s: float) -> Answer | None:
        self._arguments.append(byte)
        third = self._command == _MOTION and len(self._arguments) == 3
        if third and self._profile.encoder_codes[byte & 0b11] == 7:
            self._wanted = ARGUMENTS_OF_SEVEN
        if len(self._arguments) < self._wanted:
            return None
        arguments = bytes(self._arguments)
        self.state = FirmwareState.IDLE
        if self._command == _MARKER:
            return Answer(AnswerKind.MARKER, bytes((_MARKER,)) + arguments)
        if self._command == _SET_PARAMETERS:
            block = bytes((PARAMETERS, len(arguments))) + arguments
            self._description[PARAMETERS] = Answer(AnswerKind.PARAMETERS, block)
        if self._command in _MEMORY_WRITES:
            return None
        if self._command == _MOTION:
            self._begin_report(arguments, now_s)
        else:
            self.asked_rate = rate_of_code(arguments[0])
        return Answer(AnswerKind.ECHO, bytes((self._command,)))

    def _begin_report(self, arguments: bytes, now_s: float) -> None:
        self._report = MotionReport(arguments, now_s, self._read(now_s))
        self.state = FirmwareState.MOTION

    def _send_report(self, report: MotionReport, now_s: float) -> list[Answer]:
        length = packet_length(report.command, self._profile.encoder_codes)
        period = max(report.period_s, length * self.byte_s)
        report.due_s = max(report.due_s + period, now_s - period)
        reading = self._read(now_s)
        if not report.wants(reading):
            return []
        report.sent = reading
        packet = self._packet(report.command, reading, now_s)
        return [] if packet is None else [packet]

    def _read(self, now_s: float) -> Reading:
        counts, buttons = self._motion.latch(now_s)
        return Reading(counts, buttons)

    def _packet(self, command: int, reading: Reading, now_s: float) -> Answer | None:
        if not self.homed:
            return None
        # Even periods of a report are even in the timer, too, whatever sums round to.
        ticks = int((now_s - self.timer_zero_s) * TICKS_PER_S + ROUNDING_TICKS)
        timer = ticks % (self._profile.maxima.timer + 1)
        codes = self._profile.encoder_codes
        return Answer(
            AnswerKind.PACKET, standard_packet(command, reading, timer, codes)
        )


def rate_of_code(code: int) -> int:
    """Return bits per second: prescaler in bits 5-4, power of two in bits 2-0."""
    return round(FASTEST_RATE / (_PRESCALER[code >> 4 & 0b11] << (code & 0b111)))
