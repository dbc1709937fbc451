"""What a fault may do to an emulated arm.

A new fault is a subclass with an ``id``, a ``word`` and a ``line``, one or more of the
methods below and a place among the kinds that ``parse_fault`` is given.
"""

import random
from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, ClassVar

from devices.microscribe.emulator.answer import Answer, AnswerKind
from devices.microscribe.emulator.faults.schedule import Schedule, Trigger
from devices.microscribe.kinematics.profiles import ArmProfile
from system import UserError

if TYPE_CHECKING:
    from devices.microscribe.emulator.emulated_arm import EmulatedArm

EVERY_KIND = frozenset(AnswerKind) - {AnswerKind.FOREIGN}


class Fault:
    """One fault on its schedule; this base class changes nothing."""

    id: ClassVar[str]
    """Number in the protocol's list, such as ``f8``; its word for one without."""
    word: ClassVar[str]
    line: ClassVar[str]
    """One line for a person."""
    variants: ClassVar[tuple[str, ...]] = ()
    """Choices after ``=``, the usual one first; empty when there is no choice."""
    takes_number: ClassVar[bool] = False
    """Whether a number may stand in place of a variant."""
    lasts: ClassVar[bool] = False
    """Whether it goes on from its moment for good, instead of happening once."""
    kinds: ClassVar[frozenset[AnswerKind]] = frozenset()
    """The answers that it can spoil."""
    wire_order: ClassVar[int] = 0
    """Faults of the wire act on what all others have left of an answer."""

    def __init__(self, schedule: Schedule, variant: str, noise: random.Random) -> None:
        if variant:
            self._check_variant(variant)
        self.variant = variant or (self.variants[0] if self.variants else "")
        self.schedule = schedule
        self.noise = noise
        self.trigger = Trigger(schedule, self.lasts, noise)
        self.fired = 0
        """How often it has happened."""
        self._seen = 0
        self._fired_at = -1

    @classmethod
    def name(cls) -> str:
        """Return its full name, such as ``f8_dropped_byte``."""
        return cls.word if cls.id == cls.word else f"{cls.id}_{cls.word}"

    def alter(self, profile: ArmProfile) -> ArmProfile:
        """Return the arm that the fault has made of ``profile`` before power-on."""
        return profile

    def due_s(self) -> float | None:
        """Return the script time at which it wants to be looked at, None if never."""
        return None

    def tick(self, arm: "EmulatedArm", now_s: float) -> None:
        """Let time pass."""

    def listening_rate(
        self, client_rate: int, arm: "EmulatedArm", now_s: float
    ) -> int | None:
        """Return the one rate at which the arm signs on now, None for any.

        Asked whenever a client at ``client_rate`` writes before a session is open.
        """
        return None

    def insist_on(
        self, rate: int, client_rate: int, arm: "EmulatedArm", now_s: float
    ) -> int | None:
        """Return ``rate`` while the fault lasts; it happens to clients at others."""
        if not self.trigger.fires(arm.script_s(now_s), arm.packets):
            return None
        self.fired += client_rate != rate
        return rate

    def hear(self, data: bytes, arm: "EmulatedArm", now_s: float) -> bytes:
        """Return what the arm hears of ``data``."""
        return data

    def latch(
        self, counts: tuple[int, ...], buttons: int, arm: "EmulatedArm", now_s: float
    ) -> tuple[tuple[int, ...], int]:
        """Return what the arm measures instead."""
        return counts, buttons

    def answer(self, answer: Answer, arm: "EmulatedArm", now_s: float) -> list[Answer]:
        """Return what leaves the arm in place of ``answer``."""
        if answer.kind not in self.kinds:
            return [answer]
        self._seen += 1
        # A fault of packets counts packets, any other the answers that it spoils.
        packets = AnswerKind.PACKET in self.kinds
        number = arm.packets if packets else self._seen
        if not self.trigger.fires(arm.script_s(now_s), number):
            return [answer]
        spoilt = self.spoil(answer, arm, now_s)
        self.fired += spoilt != [answer]
        return spoilt

    def spoil(self, answer: Answer, arm: "EmulatedArm", now_s: float) -> list[Answer]:
        """Return what leaves the arm when the fault happens to ``answer``."""
        return [answer]

    def arrival_s(self, at_s: float, arm: "EmulatedArm") -> float:
        """Return when bytes arrive that would arrive at ``at_s``."""
        return at_s

    def number(self, usual: float) -> float:
        """Return the number after ``=``, or the usual one."""
        return float(self.variant) if self.variant else usual

    def _check_variant(self, variant: str) -> None:
        if variant in self.variants:
            return
        if self.takes_number and variant.replace(".", "", 1).isdecimal():
            return
        choices = [*self.variants, *(["a number"] if self.takes_number else [])]
        raise UserError(
            f"fault {self.name()} takes {', '.join(choices) or 'nothing'} after =, "
            f"got {variant!r}"
        )


class EventFault(Fault, ABC):
    """Something that happens to the whole arm rather than to an answer."""

    def due_s(self) -> float | None:
        """Return when it happens, None when a packet decides."""
        return self.trigger.due_s

    def tick(self, arm: "EmulatedArm", now_s: float) -> None:
        """Make it happen when its moment has come, between two packets once."""
        if arm.packets == self._fired_at:
            return
        if self.trigger.fires(arm.script_s(now_s), arm.packets):
            self._fired_at = arm.packets
            self.fired += 1
            self.happen(arm, now_s)

    @abstractmethod
    def happen(self, arm: "EmulatedArm", now_s: float) -> None:
        """Do it."""
