"""When a fault happens.

Written ``@12.5`` (seconds since the first packet; 0 = from power-on), ``@12.5+3`` (for
three seconds), ``@packet:200`` (at the two hundredth), ``@packet:200+5`` (at five of
them) or ``@p:0.01`` (at each with this probability). The seed makes chances repeatable.
"""

import random
import re
from dataclasses import dataclass

from system import UserError

_NUMBER = r"\d+(?:\.\d*)?|\.\d+"
_MOMENT = re.compile(rf"(?P<start>{_NUMBER})(?:\+(?P<lasts>{_NUMBER}))?")
_PACKET = re.compile(r"packet:(?P<first>\d+)(?:\+(?P<count>\d+))?")
_CHANCE = re.compile(rf"p:(?P<chance>{_NUMBER})")

FORMS = "SECONDS, SECONDS+DURATION, packet:N, packet:N+COUNT or p:PROBABILITY"


@dataclass(frozen=True, slots=True)
class Schedule:
    """At a time, at a packet, or by chance."""

    start_s: float = 0.0
    duration_s: float | None = None
    packet: int | None = None
    count: int | None = None
    chance: float | None = None

    def __post_init__(self) -> None:
        if self.chance is not None and not 0.0 <= self.chance <= 1.0:
            raise UserError(f"probability must be 0..1, got {self.chance:g}")
        if self.packet is not None and self.packet < 1:
            raise UserError(f"packets are counted from 1, got {self.packet}")


def parse_schedule(text: str) -> Schedule:
    """Read what stands behind the @; raise ValueError that tells the forms."""
    if match := _MOMENT.fullmatch(text):
        lasts = match["lasts"]
        return Schedule(float(match["start"]), float(lasts) if lasts else None)
    if match := _PACKET.fullmatch(text):
        count = match["count"]
        return Schedule(packet=int(match["first"]), count=int(count) if count else None)
    if match := _CHANCE.fullmatch(text):
        return Schedule(chance=float(match["chance"]))
    raise UserError(f"the moment of a fault must be {FORMS}, got {text!r}")


class Trigger:
    """A schedule under way.

    A fault that lasts goes on from its moment for good, one that does not happens
    once; a duration or a count says otherwise.
    """

    def __init__(self, schedule: Schedule, lasts: bool, noise: random.Random) -> None:
        self._schedule = schedule
        self._lasts = lasts
        self._noise = noise
        self._spent = False
        self._drawn_for = -1
        self._drawn = False

    @property
    def due_s(self) -> float | None:
        """Return the time of a fault that is still to come at a time, else None."""
        timed = self._schedule.packet is None and self._schedule.chance is None
        return self._schedule.start_s if timed and not self._spent else None

    def fires(self, script_s: float, number: int) -> bool:
        """Return whether the fault happens at this time to packet ``number``."""
        plan = self._schedule
        if plan.chance is not None:
            # One draw a packet, however often somebody asks.
            if number != self._drawn_for:
                self._drawn_for = number
                self._drawn = self._noise.random() < plan.chance
            return self._drawn
        if plan.packet is not None:
            begun, window = number >= plan.packet, plan.count is not None
            over = window and number >= plan.packet + (plan.count or 0)
        else:
            begun, window = script_s >= plan.start_s, plan.duration_s is not None
            over = window and script_s >= plan.start_s + (plan.duration_s or 0.0)
        if not begun or over:
            return False
        if self._lasts or window:
            return True
        first, self._spent = not self._spent, True
        return first
