"""Encoders that no longer follow the hand.

A dead encoder repeats its count for ever. A hand that moves an arm cannot do that:
while the other joints turn, each of them stirs by some counts in a second. Missed
counts and a reversed sense of rotation, however, look like motion; only a measurement
of something known finds those.
"""

from collections.abc import Sequence

FROZEN_S = 5.0

# Looked at in steps, since a slow hand moves no whole count between two packets.
STEP_S = 0.1

# Rounding makes an arm at rest flicker by one.
MOVED_COUNTS = 3


class EncoderWatch:
    """Find the encoders that stood still while others moved for five seconds."""

    def __init__(self, present: Sequence[bool]) -> None:
        """Watch the joints that have an encoder."""
        self._joints = [i for i, there in enumerate(present) if there]
        self._still_s = [0.0] * len(present)
        self._counts: Sequence[int] | None = None
        self._time_s = 0.0

    @property
    def frozen(self) -> tuple[int, ...]:
        """Return the joints whose encoders seem dead."""
        return tuple(i for i in self._joints if self._still_s[i] >= FROZEN_S)

    def observe(self, counts: Sequence[int], time_s: float) -> None:
        """Take unwrapped counts and the arm's time, which does not fall."""
        passed = time_s - self._time_s
        if self._counts is None:
            self._counts, self._time_s = counts, time_s
        elif passed >= STEP_S:
            self._look(self._counts, counts, passed)
            self._counts, self._time_s = counts, time_s

    def _look(self, old: Sequence[int], new: Sequence[int], passed_s: float) -> None:
        moving = any(abs(new[i] - old[i]) >= MOVED_COUNTS for i in self._joints)
        for i in self._joints:
            if new[i] != old[i]:
                self._still_s[i] = 0.0
            elif moving:
                # A pause of the packets says nothing about what went on meanwhile.
                self._still_s[i] += min(passed_s, 2.0 * STEP_S)
