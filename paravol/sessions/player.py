"""A recorded session's position, played against a clock: no window, no pictures.

Everything is counted from where the playback was last set: the position, and the
moments at which frames are due. So no error adds up, however late a frame was.
"""

import math
from bisect import bisect_right
from collections.abc import Sequence
from itertools import accumulate

from devices.port import Clock
from system import UserError

SLOWEST, FASTEST = 0.1, 10.0
"""Speeds that can be played."""

_SAME_FRAME = 1e-6
"""Share of a frame by which a clock may be early, for rounding alone."""


class Player:
    """Which moment of a session is to be shown now.

    A new one stands at the first sample. times_s: of the samples in order; where a
    clock ran backwards it stands until it has caught up. loop_s: from and to where the
    playback goes round, None to stop at the last sample.
    """

    def __init__(
        self,
        times_s: Sequence[float],
        clock: Clock,
        *,
        speed: float = 1.0,
        loop_s: tuple[float, float] | None = None,
    ) -> None:
        """UserError for no sample, a speed or a loop that cannot be played."""
        if not times_s:
            raise UserError("There is no sample to play.")
        self.times_s = list(accumulate(times_s, max))
        if loop_s is not None and not self.begin_s <= loop_s[0] < loop_s[1]:
            raise UserError(f"cannot go round from {loop_s[0]:g} to {loop_s[1]:g} s")
        self.loop_s = loop_s
        self.is_playing = False
        self._clock = clock
        self._speed = 1.0
        self._anchor_s, self._anchored_at = self.begin_s, clock.now()
        self.speed = speed

    @property
    def begin_s(self) -> float:
        """Return the time of the first sample."""
        return self.times_s[0]

    @property
    def end_s(self) -> float:
        """Return the time of the last sample."""
        return self.times_s[-1]

    @property
    def speed(self) -> float:
        """Return seconds of the session in one of the clock."""
        return self._speed

    @speed.setter
    def speed(self, speed: float) -> None:
        """Go on from here at another speed."""
        require_speed(speed)
        self.seek(self.position_s)
        self._speed = speed

    @property
    def position_s(self) -> float:
        """Return the session's time that is to be shown now."""
        position = self._anchor_s
        if self.is_playing:
            position += self._speed * (self._clock.now() - self._anchored_at)
        if self.loop_s is not None:
            first, last = self.loop_s
            if position >= min(last, self.end_s):
                position = first + (position - first) % (min(last, self.end_s) - first)
        return min(position, self.end_s)

    @property
    def place(self) -> int:
        """Return the place of the newest sample at the position."""
        return max(bisect_right(self.times_s, self.position_s) - 1, 0)

    @property
    def is_over(self) -> bool:
        """Return whether the last sample is reached, and nothing goes round."""
        return self.loop_s is None and self.position_s >= self.end_s

    def play(self) -> None:
        """Go on from here."""
        self.seek(self.position_s)
        self.is_playing = True

    def pause(self) -> None:
        """Stand here."""
        self.seek(self.position_s)
        self.is_playing = False

    def seek(self, time_s: float) -> None:
        """Go to a time, held within the session; a playback goes on from there."""
        if math.isnan(time_s):
            raise UserError("cannot go to no time")
        self._anchor_s = min(max(time_s, self.begin_s), self.end_s)
        self._anchored_at = self._clock.now()

    def step(self, samples: int) -> None:
        """Stand at a sample so many after the one that is shown, or before it."""
        place = min(max(self.place + samples, 0), len(self.times_s) - 1)
        self.is_playing = False
        self.seek(self.times_s[place])

    def next_frame_s(self, fps: float) -> float:
        """Return how long it is to the next frame; 0 or more of the clock's seconds.

        Frames are due at whole periods since the playback was last set. One that was
        missed is left out.
        """
        passed = self._clock.now() - self._anchored_at
        number = math.floor(passed * fps + _SAME_FRAME) + 1
        return max(number / fps - passed, 0.0)


def require_speed(speed: float) -> None:
    """UserError for a speed that cannot be played."""
    if not SLOWEST <= speed <= FASTEST:
        raise UserError(
            f"A session can be played at {SLOWEST:g} to {FASTEST:g} times its speed, "
            f"not at {speed:g}."
        )
