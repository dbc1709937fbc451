"""All faults by name, and how one is written.

``NAME[=VARIANT][@MOMENT]``; a name is the number, the word or both: ``f8``,
``dropped_byte``, ``f8_dropped_byte``.
"""

import random
from collections.abc import Iterable
from dataclasses import dataclass
from difflib import get_close_matches

from devices.microscribe.emulator.faults.description_faults import (
    BadMaxima,
    BadParameters,
    BadString,
    SilentBeta,
)
from devices.microscribe.emulator.faults.fault import Fault
from devices.microscribe.emulator.faults.motion_faults import (
    EncoderWrap,
    Pedals,
    SickEncoder,
)
from devices.microscribe.emulator.faults.packet_faults import (
    DoubledByte,
    DroppedByte,
    FlippedBit,
    Garbage,
    Noise,
    WrongTopBit,
)
from devices.microscribe.emulator.faults.schedule import Schedule, parse_schedule
from devices.microscribe.emulator.faults.session_faults import (
    Loopback,
    MemoryWrite,
    PowerCycle,
    StreamGoesOn,
    TimerWrap,
    Unhomed,
)
from devices.microscribe.emulator.faults.sign_on_faults import (
    EndEcho,
    LeftOpen,
    NeverAnswers,
    NoBegin,
    OneRate,
    SurplusEchoes,
    WrongId,
)
from devices.microscribe.emulator.faults.timing_faults import (
    Bursts,
    Chunks,
    CutShort,
    LateReply,
    Slow,
)
from devices.microscribe.kinematics.profiles import ArmProfile
from disk import UserError

FAULTS: tuple[type[Fault], ...] = (
    NeverAnswers,
    OneRate,
    SurplusEchoes,
    EndEcho,
    NoBegin,
    WrongId,
    LeftOpen,
    DroppedByte,
    DoubledByte,
    FlippedBit,
    WrongTopBit,
    Noise,
    Chunks,
    Bursts,
    LateReply,
    CutShort,
    PowerCycle,
    EncoderWrap,
    TimerWrap,
    BadString,
    BadParameters,
    BadMaxima,
    SilentBeta,
    Unhomed,
    Pedals,
    StreamGoesOn,
    SickEncoder,
    Loopback,
    MemoryWrite,
    Slow,
    Garbage,
)

# Short words for what people try first, with their variants.
SHORT_NAMES = {
    "mute": (NeverAnswers, ""),
    "unplug": (CutShort, "UNPLUG"),
    "stall": (CutShort, "STALL"),
    "replug": (CutShort, "REPLUG"),
}

_BY_NAME: dict[str, tuple[type[Fault], str]] = {
    **{kind.word: (kind, "") for kind in FAULTS},
    **{kind.id: (kind, "") for kind in FAULTS if kind.id},
    **{kind.name(): (kind, "") for kind in FAULTS},
    **SHORT_NAMES,
}

# Faults of the wire act on what all others have left of an answer.
_LAST: tuple[type[Fault], ...] = (Slow, LateReply, Chunks, CutShort)


@dataclass(frozen=True, slots=True)
class FaultPlan:
    """A fault and when it happens, before an arm has it."""

    kind: type[Fault]
    variant: str
    schedule: Schedule

    def make(self, noise: random.Random) -> Fault:
        """Return the fault itself; raise ValueError for a variant it lacks."""
        return self.kind(self.schedule, self.variant, noise)


def parse_fault(text: str) -> FaultPlan:
    """Read ``NAME[=VARIANT][@MOMENT]``; raise ValueError that tells what is known."""
    what, at, moment = text.partition("@")
    name, equals, variant = what.partition("=")
    name = name.strip().lower()
    known = _BY_NAME.get(name)
    if known is None:
        near = get_close_matches(name, [*_BY_NAME], 1, 0.3)
        hint = f"; the nearest is {near[0]!r}" if near else ""
        raise UserError(
            f"fault {name!r} is not known{hint} (--list-faults prints all: "
            f"{FAULTS[0].name()} to {Slow.name()})"
        )
    if (at and not moment) or (equals and not variant):
        raise UserError(f"fault must be NAME[=VARIANT][@MOMENT], got {text!r}")
    kind, usual = known
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
    return sorted(
        faults, key=lambda f: _LAST.index(type(f)) + 1 if type(f) in _LAST else 0
    )


def altered_profile(profile: ArmProfile, faults: Iterable[Fault]) -> ArmProfile:
    """Return the arm that faults have made of ``profile``."""
    for fault in faults:
        if isinstance(fault, BadMaxima):
            profile = fault.alter(profile)
    return profile


def list_faults() -> dict[str, str]:
    """Return a line for every fault, by number, then for the short names."""
    return {kind.name(): kind.line for kind in FAULTS} | {
        name: f"short for {kind.name()}{'=' + variant if variant else ''}"
        for name, (kind, variant) in SHORT_NAMES.items()
    }
