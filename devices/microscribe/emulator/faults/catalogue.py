"""The faults that arms and their lines really show, by name, and how one is written.

``NAME[=VARIANT][@MOMENT]``; a name is the number, the word or both: ``f8``,
``dropped_byte``, ``f8_dropped_byte``. Numbers are those of the protocol's description.
"""

import math
import random
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from typing import TYPE_CHECKING

from devices.microscribe.emulator.answer import Answer, AnswerKind, ReplyTrigger
from devices.microscribe.emulator.faults.fault import EVERY_KIND, EventFault, Fault
from devices.microscribe.emulator.faults.schedule import Schedule, parse_schedule
from devices.microscribe.kinematics.arm import FIELD
from system import UserError

if TYPE_CHECKING:
    from devices.microscribe.emulator.emulated_arm import EmulatedArm

_PACKETS = frozenset((AnswerKind.PACKET,))
_TOP_BIT = 0x80
_MOST_NOISE = 8

_ADAPTER_MS = 16.0
# Past a reader's usual 100 ms and the 50 ms in which it lets the line settle: the
# answer comes while the next one is awaited.
_LATE_MS = 180.0
_SLOWEST_MS = 30.0
_SLOW_RATE = 9600

_MOST_MISSED = 5


class NeverAnswers(Fault):
    """F1."""

    id, word = "f1", "never_answers"
    line = "the arm's answers do not arrive"
    lasts = True
    kinds = EVERY_KIND

    def spoil(self, answer: Answer, arm: "EmulatedArm", now_s: float) -> list[Answer]:
        return []


class DroppedByte(Fault):
    """F8."""

    id, word = "f8", "dropped_byte"
    line = "one byte of a packet is lost (=POSITION, else any)"
    takes_number = True
    kinds = _PACKETS

    def spoil(self, answer: Answer, arm: "EmulatedArm", now_s: float) -> list[Answer]:
        at = self.noise.randrange(len(answer.data))
        if self.variant:
            at = min(int(self.number(0)), len(answer.data) - 1)
        return [replace(answer, data=answer.data[:at] + answer.data[at + 1 :])]


class FlippedBit(Fault):
    """F10."""

    id, word = "f10", "flipped_bit"
    line = "one of bits 0-6 of a payload byte is flipped: no reader can see it"
    kinds = _PACKETS

    def spoil(self, answer: Answer, arm: "EmulatedArm", now_s: float) -> list[Answer]:
        data = bytearray(answer.data)
        data[self.noise.randrange(1, len(data))] ^= 1 << self.noise.randrange(7)
        return [replace(answer, data=bytes(data))]


class Noise(Fault):
    """F12."""

    id, word = "f12", "noise"
    line = "1-8 random bytes in front of a packet, =MIXED, LOW or HIGH (bit 7)"
    variants = ("MIXED", "LOW", "HIGH")
    kinds = _PACKETS

    def spoil(self, answer: Answer, arm: "EmulatedArm", now_s: float) -> list[Answer]:
        noise = bytearray(self.noise.randbytes(self.noise.randint(1, _MOST_NOISE)))
        for i, byte in enumerate(noise):
            if self.variant == "LOW":
                noise[i] = byte & ~_TOP_BIT
            elif self.variant == "HIGH":
                noise[i] = byte | _TOP_BIT
        return [Answer(AnswerKind.FOREIGN, bytes(noise)), answer]


class Garbage(Fault):
    """Every answer becomes random bytes of about its length."""

    id = word = "garbage"
    line = "every answer becomes random bytes of about its length"
    lasts = True
    kinds = EVERY_KIND

    def spoil(self, answer: Answer, arm: "EmulatedArm", now_s: float) -> list[Answer]:
        noise = self.noise.randbytes(len(answer.data) + self.noise.randrange(3))
        return [replace(answer, data=noise)]


class Bursts(Fault):
    """F14."""

    id, word = "f14", "bursts"
    line = "bytes are handed over every =MS milliseconds only, as by a USB adapter (16)"
    takes_number = True
    lasts = True

    def arrival_s(self, at_s: float, arm: "EmulatedArm") -> float:
        if not self.trigger.fires(arm.script_s(at_s), arm.packets):
            return at_s
        self.fired += 1
        latency_s = self.number(_ADAPTER_MS) / 1e3
        return math.ceil(at_s / latency_s) * latency_s if latency_s else at_s


class LateReply(Fault):
    """F15."""

    id, word = "f15", "late_reply"
    wire_order = 2
    line = "a packet comes after the reader gave up (=MS late, else 180)"
    takes_number = True
    kinds = frozenset((AnswerKind.PACKET,))

    def spoil(self, answer: Answer, arm: "EmulatedArm", now_s: float) -> list[Answer]:
        return [replace(answer, delay_s=self.number(_LATE_MS) / 1e3)]


class TruncatedReply(Fault):
    """F16."""

    id, word = "f16", "cut_short"
    wire_order = 4
    line = "in the middle of an answer =UNPLUG, STALL for ever, or REPLUG elsewhere"
    variants = ("UNPLUG", "STALL", "REPLUG")
    kinds = EVERY_KIND

    def spoil(self, answer: Answer, arm: "EmulatedArm", now_s: float) -> list[Answer]:
        half = answer.data[: (len(answer.data) + 1) // 2]
        return [replace(answer, data=half, after=ReplyTrigger[self.variant])]


class PowerCycle(EventFault):
    """F17."""

    id, word = "f17", "power_cycle"
    line = "off and on: no session, timer zero, home counts wherever the arm stands"

    def happen(self, arm: "EmulatedArm", now_s: float) -> None:
        arm.power_cycle(now_s)


class EncoderDropout(Fault):
    """F27."""

    id, word = "f27", "sick_encoder"
    line = "an encoder DEAD, with MISSED counts, or BACKWARDS (=DEAD2: number 2)"
    variants = tuple(
        f"{illness}{joint}"
        for joint in (2, 0, 1, 3, 4, 5)
        for illness in ("DEAD", "MISSED", "BACKWARDS")
    )
    lasts = True

    def __init__(self, schedule: Schedule, variant: str, noise: random.Random) -> None:
        # Without a number it is the elbow's.
        if variant and not variant[-1].isdigit():
            variant += "2"
        super().__init__(schedule, variant, noise)
        self._joint = int(self.variant[-1])
        self._illness = self.variant[:-1]
        self._at_onset: int | None = None
        self._missed = 0

    def latch(
        self, counts: tuple[int, ...], buttons: int, arm: "EmulatedArm", now_s: float
    ) -> tuple[tuple[int, ...], int]:
        true = counts[self._joint]
        if self.trigger.fires(arm.script_s(now_s), arm.packets + 1):
            self.fired += 1
            if self._at_onset is None:
                self._at_onset = true
            self._missed += self.noise.randint(1, _MOST_MISSED)
        elif self._illness != "MISSED":
            self._at_onset = None
        read = true
        if self._illness == "MISSED":
            # What was missed once stays missing.
            read = true - self._missed
        elif self._at_onset is not None:
            turned = true - self._at_onset
            read = self._at_onset - (turned if self._illness == "BACKWARDS" else 0)
        sick = list(counts)
        sick[self._joint] = read % FIELD
        return tuple(sick), buttons


class Slow(Fault):
    """F30."""

    id, word = "f30", "slow"
    wire_order = 1
    line = "1 to =MS milliseconds (else 30) more before answers; signs on at 9600 only"
    takes_number = True
    lasts = True
    kinds = EVERY_KIND

    def listening_rate(
        self, client_rate: int, arm: "EmulatedArm", now_s: float
    ) -> int | None:
        return self.insist_on(_SLOW_RATE, client_rate, arm, now_s)

    def spoil(self, answer: Answer, arm: "EmulatedArm", now_s: float) -> list[Answer]:
        slowest_ms = max(1.0, self.number(_SLOWEST_MS))
        thought_s = self.noise.uniform(1.0, slowest_ms) / 1e3
        return [replace(answer, delay_s=answer.delay_s + thought_s)]


FAULTS: tuple[type[Fault], ...] = (
    NeverAnswers,
    DroppedByte,
    FlippedBit,
    Noise,
    Bursts,
    LateReply,
    TruncatedReply,
    PowerCycle,
    EncoderDropout,
    Slow,
    Garbage,
)

# Short words for what people try first, with their variants.
SHORT_NAMES = {
    "mute": (NeverAnswers, ""),
    "unplug": (TruncatedReply, "UNPLUG"),
    "stall": (TruncatedReply, "STALL"),
    "replug": (TruncatedReply, "REPLUG"),
}


@dataclass(frozen=True, slots=True)
class FaultPlan:
    """A fault and when it happens, before an arm has it."""

    kind: type[Fault]
    variant: str
    schedule: Schedule

    def make(self, noise: random.Random) -> Fault:
        """Return the fault itself; raise UserError for a variant that it lacks."""
        return self.kind(self.schedule, self.variant, noise)


def parse_fault(text: str, kinds: Sequence[type[Fault]] = FAULTS) -> FaultPlan:
    """Read ``NAME[=VARIANT][@MOMENT]``; raise UserError that names the known ones.

    ``kinds`` are the faults to choose from.
    """
    what, at, moment = text.partition("@")
    name, equals, variant = what.partition("=")
    name = name.strip().lower()
    by_name: dict[str, tuple[type[Fault], str]] = dict(SHORT_NAMES)
    for kind in kinds:
        by_name |= dict.fromkeys((kind.word, kind.id, kind.name()), (kind, ""))
    if not name or name not in by_name:
        near = get_close_matches(name, [*by_name], 1, 0.3)
        hint = f"; the nearest is {near[0]!r}" if near else ""
        raise UserError(f"fault {name!r} is not known{hint} (--list-faults prints all)")
    if (at and not moment) or (equals and not variant):
        raise UserError(f"fault must be NAME[=VARIANT][@MOMENT], got {text!r}")
    kind, usual = by_name[name]
    schedule = parse_schedule(moment) if at else Schedule()
    plan = FaultPlan(kind, variant.upper() or usual, schedule)
    plan.make(random.Random(0))
    return plan


def make_faults(plans: Iterable[FaultPlan], seed: int) -> list[Fault]:
    """Return the faults of one arm, each with its own chance, the wire's last."""
    faults = [
        plan.make(random.Random(f"{seed} {i} {plan.kind.name()}"))
        for i, plan in enumerate(plans)
    ]
    return sorted(faults, key=lambda fault: fault.wire_order)


def list_faults() -> dict[str, str]:
    """Return a line for every fault, by number, then for the short names."""
    return {kind.name(): kind.line for kind in FAULTS} | {
        name: f"short for {kind.name()}{'=' + variant if variant else ''}"
        for name, (kind, variant) in SHORT_NAMES.items()
    }
