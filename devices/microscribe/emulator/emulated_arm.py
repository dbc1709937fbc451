"""One emulated arm with its line: bytes go in and come out at their times.

Nothing here waits or opens anything. Whoever owns a port calls ``hear`` with what the
client wrote, ``speak`` for what has arrived at the client by now, and sleeps until
``next_s``. Time is an argument, seconds of any monotonic clock.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Protocol

from devices.microscribe.emulator.answer import Answer, AnswerKind, ReplyTrigger
from devices.microscribe.emulator.emulated_line import RATES, PacedOutput, misread
from devices.microscribe.emulator.faults.catalogue import FaultPlan, make_faults
from devices.microscribe.emulator.firmware import (
    BITS_PER_BYTE,
    ArmFirmware,
    ArmMotion,
    FirmwareState,
)
from devices.microscribe.emulator.transcript import Transcript
from devices.microscribe.kinematics.profiles import ArmProfile
from system import UserError

DEFAULT_RATE = 115200

# A sum of times may round to just before the moment that it stands for.
ROUNDING_S = 1e-9

# From the unplugging to the new port of a fault that plugs in again by itself.
REPLUG_AFTER_S = 1.0


class LiveMotion(ArmMotion, Protocol):
    """What the arm would measure, from the first packet on."""

    def begin(self, now_s: float) -> None:
        """Start the motion's own clock; harmless when repeated."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class ArmTraits:
    """How an emulated arm and its line behave."""

    seed: int = 0
    """Of the chances of faults."""
    fast: bool = False
    """Leave out all delays of the line."""
    rate: int = DEFAULT_RATE
    """The line's before anybody has signed on, and for good where nobody can tell the
    client's."""
    sync_repeats: int = 1
    """How often the arm must hear IMMC before the first echo."""
    accepts_memory_writes: bool = False

    def __post_init__(self) -> None:
        if self.rate not in RATES:
            raise UserError(f"rate must be one of {RATES}, got {self.rate}")


class EmulatedArm:
    """An arm, its power, its plug, its pedals and its faults."""

    def __init__(
        self,
        profile: ArmProfile,
        motion: LiveMotion,
        *,
        faults: Iterable[FaultPlan] = (),
        traits: ArmTraits | None = None,
        now_s: float = 0.0,
        transcript: Transcript | None = None,
    ) -> None:
        traits = traits or ArmTraits()
        self._faults = make_faults(faults, traits.seed)
        self.profile = profile
        for fault in self._faults:
            self.profile = fault.alter(self.profile)
        self.session_rate = traits.rate
        self.packets = 0
        """Standard packets measured."""
        self.powered = True
        self.plugged = True
        self.lost_for_good = False
        """Whether a fault pulled the plug and nobody will put it back."""
        self.generation = 1
        """How often the plug has been put in; each time the port has a new name."""
        self._motion = motion
        self.firmware = ArmFirmware(
            self.profile,
            self,
            now_s,
            sync_repeats=traits.sync_repeats,
            accepts_memory_writes=traits.accepts_memory_writes,
        )
        self._output = PacedOutput(traits.fast, self._arrival_s)
        self._transcript = transcript
        self._pedals: dict[int, float] = {}
        self._first_packet_s: float | None = None
        self._stalled = False
        self._replug_s: float | None = None
        self._ticked_s = now_s
        self._tell(now_s, "power on")
        self._tick(now_s)

    @property
    def fired(self) -> dict[str, int]:
        """Return how often each fault has happened, by its full name."""
        return {fault.name(): fault.fired for fault in self._faults}

    def script_s(self, now_s: float) -> float:
        """Return seconds since the first packet, 0 before it."""
        begun = self._first_packet_s
        return 0.0 if begun is None else max(0.0, now_s - begun)

    def hear(self, data: bytes, now_s: float, client_rate: int | None = None) -> None:
        """Take what the client wrote; ``client_rate`` None where nobody can tell."""
        self.pass_time(now_s)
        if not (data and self.powered and self.plugged):
            return
        heard = data
        if client_rate is not None:
            heard = self._receive_at(data, client_rate, now_s)
        for fault in self._faults:
            heard = fault.hear(heard, self, now_s)
        # The last bit of what was written is on the line only now.
        wire_s = 0.0 if self._output.fast else len(heard) * self.firmware.byte_s
        self._hear(heard, now_s, now_s + wire_s)

    def speak(self, now_s: float, client_rate: int | None = None) -> bytes:
        """Return what has arrived at the client since the last call."""
        self.pass_time(now_s)
        out = bytearray()
        while (delivery := self._output.due(now_s)) is not None:
            # A port that was pulled or has stalled loses what was on its way.
            if self.plugged and not self._stalled:
                rate = client_rate or delivery.rate
                out += misread(delivery.data, delivery.rate, rate)
            if delivery.after is not None:
                self._befall(delivery.after, delivery.at_s)
        return bytes(out)

    def next_s(self) -> float | None:
        """Return when ``speak`` has something to do next, None if never."""
        due = [self._output.next_s(), self.firmware.next_s(), self._replug_s]
        for fault in self._faults:
            script_s = fault.due_s()
            if script_s is not None and self._first_packet_s is not None:
                at_s = self._first_packet_s + script_s + ROUNDING_S
                if at_s > self._ticked_s:
                    due.append(at_s)
        return min((at for at in due if at is not None), default=None)

    def power_off(self, now_s: float) -> None:
        """Cut the power."""
        self.powered = False
        self._output.clear()
        self.firmware.power_on(now_s)
        self._tell(now_s, "power off")

    def power_on(self, now_s: float) -> None:
        """Give power: no session, timer zero, home counts wherever the arm stands."""
        self._motion.latch(now_s)
        self._motion.home()
        self._output.clear()
        self.firmware.power_on(now_s)
        self.powered, self._stalled = True, False
        self._tell(now_s, "power on")

    def power_cycle(self, now_s: float) -> None:
        """Cut the power and give it back at once."""
        self.power_off(now_s)
        self.power_on(now_s)

    def unplug(self, now_s: float) -> None:
        """Pull the data plug; the arm keeps its power and its session."""
        if self.plugged:
            self.plugged = False
            self._output.clear()
            self._tell(now_s, "unplugged")

    def replug(self, now_s: float) -> None:
        """Put the data plug in again: a port with a new name."""
        self._replug_s = None
        if not self.plugged:
            self.plugged, self._stalled = True, False
            self.generation += 1
            self._tell(now_s, "plugged in")

    def press_home_button(self, now_s: float) -> None:
        """Press Home: the arm measures from now on, and believes to be in its rest."""
        self._motion.latch(now_s)
        self._motion.home()
        self.firmware.homed = True
        self._tell(now_s, "home button")

    def hold_pedal(self, bit: int, until_s: float = float("inf")) -> None:
        """Press a pedal (0 right, 1 left) until ``until_s``; -inf lets it go."""
        if not 0 <= bit < 4:
            raise UserError(f"pedal must be bit 0..3, got {bit}")
        self._pedals[bit] = until_s

    def send_foreign(self, data: bytes, now_s: float) -> None:
        """Let the client hear bytes that the arm did not send."""
        self._output.push(Answer(AnswerKind.FOREIGN, data), self.session_rate, now_s)

    def home(self) -> None:
        """Load the rest pose's counts, wherever the arm stands."""
        self._motion.home()

    def latch(self, now_s: float) -> tuple[tuple[int, ...], int]:
        """Return what the arm measures now, faults and pedals included."""
        counts, buttons = self._motion.latch(now_s)
        for bit, until_s in self._pedals.items():
            buttons |= (now_s < until_s) << bit
        for fault in self._faults:
            counts, buttons = fault.latch(counts, buttons, self, now_s)
        return counts, buttons

    def _receive_at(self, data: bytes, client_rate: int, now_s: float) -> bytes:
        if self.firmware.state is FirmwareState.SYNC:
            only = [f.listening_rate(client_rate, self, now_s) for f in self._faults]
            wanted = next((rate for rate in only if rate is not None), None)
            if wanted is not None:
                self._keep_rate(wanted)
            elif client_rate in RATES:
                self._keep_rate(client_rate)
        return misread(data, client_rate, self.session_rate)

    def _keep_rate(self, rate: int) -> None:
        self.session_rate = rate
        self.firmware.byte_s = BITS_PER_BYTE / rate

    def _hear(self, data: bytes, now_s: float, heard_s: float) -> None:
        writes = self.firmware.memory_writes
        commands = self.firmware.standard_commands
        state = self.firmware.state
        answers = self.firmware.answers(data, now_s)
        if self._transcript is not None and data:
            self._transcript.heard(now_s, state.name, data)
        if self.firmware.memory_writes > writes:
            self._tell(now_s, "a write to the calibration memory was asked for")
        self._say(answers, heard_s)
        if self.firmware.standard_commands > commands:
            self._begin(now_s)
        if self.firmware.asked_rate is not None:
            # The echo still goes out at the old rate; what else is pending is lost.
            self._keep_rate(self.firmware.asked_rate)
            self.firmware.asked_rate = None

    def _begin(self, now_s: float) -> None:
        if self._first_packet_s is None:
            self._first_packet_s = now_s
            self._motion.begin(now_s)

    def _say(self, answers: list[Answer], now_s: float) -> None:
        for answer in answers:
            self.packets += answer.kind is AnswerKind.PACKET
            pieces = [answer]
            for fault in self._faults:
                pieces = [
                    spoilt
                    for piece in pieces
                    for spoilt in fault.answer(piece, self, now_s)
                ]
            if self._transcript is not None:
                self._transcript.said(now_s, self.firmware.state.name, answer, pieces)
            for piece in pieces:
                self._output.push(piece, self.session_rate, now_s)

    def pass_time(self, now_s: float) -> None:
        """Let happen what is due; ``hear`` and ``speak`` do it, too."""
        self._tick(now_s)
        # A report sends each packet at its own time, however late somebody looks.
        while (due := self.firmware.next_s()) is not None and due <= now_s:
            self._say(self.firmware.pass_time(due), due)
            self._begin(due)
            self._tick(due)
        self._say(self.firmware.pass_time(now_s), now_s)

    def _tick(self, now_s: float) -> None:
        self._ticked_s = max(self._ticked_s, now_s)
        if self._replug_s is not None and now_s >= self._replug_s:
            self.replug(now_s)
        if self.powered:
            for fault in self._faults:
                fault.tick(self, now_s)

    def _befall(self, after: ReplyTrigger, now_s: float) -> None:
        if after is ReplyTrigger.STALL:
            self._stalled = True
            self._tell(now_s, "stalled")
            return
        self.unplug(now_s)
        if after is ReplyTrigger.REPLUG:
            self._replug_s = now_s + REPLUG_AFTER_S
        else:
            self.lost_for_good = True

    def _arrival_s(self, at_s: float) -> float:
        for fault in self._faults:
            at_s = fault.arrival_s(at_s, self)
        return at_s

    def _tell(self, now_s: float, event: str) -> None:
        if self._transcript is not None:
            self._transcript.happened(now_s, event)
