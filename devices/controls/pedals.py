"""Foot pedals as events, and as presses with the poses measured meanwhile.

A contact that closes or opens chatters for 2 to 10 ms. An edge is told at once and the
level is then held for 20 ms, so that a person feels no delay; what the contact does
meanwhile is chatter.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from enum import IntFlag
from math import isfinite

from devices.pose import Pose, PoseFlag
from system import UserError

HOLD_S = 0.02
"""Twice the longest bounce of a pedal; a foot needs at least a tenth of a second."""


class Button(IntFlag):
    """The pedals in a pose's ``buttons``."""

    RIGHT_PEDAL = 1
    LEFT_PEDAL = 2


PEDALS = Button.RIGHT_PEDAL | Button.LEFT_PEDAL


@dataclass(frozen=True, slots=True)
class ButtonEvent:
    """A button went down or up.

    time_s: on the clock of the poses; that of the sample that showed it.
    """

    time_s: float
    button: Button
    is_down: bool


class Debouncer:
    """Turn raw button levels into edges, one button at a time.

    A chatter shorter than ``hold_s`` gives at most one press and one release, in this
    order or the other, whatever its pattern; a level that lasts longer is always told.
    Bits outside ``debounced`` pass through ``levels`` as they are and give no events.
    """

    def __init__(self, debounced: Button = PEDALS, hold_s: float = HOLD_S) -> None:
        if not (isfinite(hold_s) and hold_s >= 0.0):
            raise UserError(f"hold_s must not be negative, got {hold_s}")
        self._debounced = tuple(debounced)
        self._mask = int(debounced)
        self._hold_s = hold_s
        self._levels = 0
        self._raw = 0
        self._held_until_s = dict.fromkeys(self._debounced, -float("inf"))
        self._last_s = -float("inf")

    @property
    def levels(self) -> int:
        """Return the debounced levels, one bit a button, and the other bits raw."""
        return self._levels | (self._raw & ~self._mask)

    def feed(self, time_s: float, raw: int) -> tuple[ButtonEvent, ...]:
        """Take the raw levels of a moment; return the edges, lowest bit first.

        Raise UserError when time runs backwards or levels are negative.
        """
        if not time_s >= self._last_s:
            raise UserError(
                f"button levels must come in order of time, got {time_s} s after "
                f"{self._last_s} s"
            )
        if raw < 0:
            raise UserError(f"buttons must not be negative, got {raw}")
        self._last_s = time_s
        self._raw = raw
        return tuple(self._edges(time_s, raw))

    def feed_pose(self, pose: Pose) -> tuple[ButtonEvent, ...]:
        """Take a pose's buttons; those of a suspect packet are not believed."""
        if pose.flags & PoseFlag.SUSPECT:
            return ()
        return self.feed(pose.time_s, pose.buttons)

    def _edges(self, time_s: float, raw: int) -> Iterator[ButtonEvent]:
        for button in self._debounced:
            if (raw ^ self._levels) & button and time_s >= self._held_until_s[button]:
                self._levels ^= button
                self._held_until_s[button] = time_s + self._hold_s
                yield ButtonEvent(time_s, button, bool(raw & button))


# A contact chatters for 2-10 ms when it opens and when it closes.
CHATTER_S = 0.03

# A foot needs at least a tenth of a second.
SHORTEST_S = 0.1


@dataclass(slots=True)
class PressCollector:
    """Turn a stream of poses into presses of one pedal.

    Interruptions shorter than 0.03 s belong to the press, presses shorter than 0.1 s
    are dropped; so are poses that may be wrong.
    """

    pedal: int
    _held: list[Pose] = field(default_factory=list)

    @property
    def held(self) -> int:
        """Return the number of poses of the press that is going on."""
        return len(self._held)

    def feed(self, pose: Pose) -> list[Pose] | None:
        """Take the next pose; return the press that ended with it, if one did."""
        if pose.buttons & self.pedal:
            if not pose.flags & (PoseFlag.JUMP | PoseFlag.SUSPECT):
                self._held.append(pose)
            return None
        if not self._held or pose.time_s - self._held[-1].time_s < CHATTER_S:
            return None
        held, self._held = self._held, []
        if held[-1].time_s - held[0].time_s < SHORTEST_S:
            return None
        return held
