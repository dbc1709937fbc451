"""How large the endoscope's picture is drawn: as on the screen, less where it is late.

A picture larger than its place on the screen costs time that nobody sees; one smaller
is blurred. The target is 30 frames a second at every size: the largest size that meets
it is drawn, however many frames a smaller one would give. Where a machine cannot draw
the size that is wanted in time, less is drawn, which is told.

Much of a frame has nothing to do with its pixels: discs, lights, what tools cut. How
much is learned from every change of the size. So it is known at any time what another
size would take, and one that was late once is drawn as soon as there is time for it.
"""

import math
import threading
from collections import deque
from collections.abc import Callable

STEPS = (256, 384, 512, 640, 768, 896, 1024, 1280, 1536, 2048)
"""Edges of pictures, pixels: a change costs a frame or so, so few are enough."""

FIRST_PX = 512
"""A flight begins with no more: whether there is time for more, it has yet to show."""

DUE_MS = 1000.0 / 30.0
"""Time for a frame: 30 frames a second look like a motion."""

LOOKED_AT, LOOKED_S = 12, 1.0
"""Frames whose median is judged, at least, and over how long: a late frame changes
nothing, and neither does a picture of the overview, which takes up to 0.4 s."""

IN_TIME_SHARE = 0.95
"""A larger size is drawn where it would take less than so much of the time."""

FIXED_PX = 378
"""Edge of the square whose pixels cost as much as what is done once a frame, until more
is known. Frames of the bundled flight took 20.6, 28.8, 39.7, 72.8 and 117.6 ms of a
busy machine's processors at 256, 384, 512, 768 and 1,024 pixels: 14.1 ms and 98.7 ms a
megapixel, within 1 %."""

MOST_FIXED_PX = 4096
"""Such a square where pixels seem to cost nothing."""

TRIED_AFTER_S = 40.0
"""The next size is tried after so long, however much it is thought to take: what was
learned may have been a moment's."""

SETTLING = 3
"""Frames after a change that are not judged: memory of the new size is first used."""

RESTS, SHARP_MS = 12, 100.0
"""Frames after which a scope that rests is shown sharper, and what that may take: it
costs one frame, and one when it goes on."""

BEGINNING = 60
"""Frames at the beginning that are not judged, one to two seconds: the overview's head
is made meanwhile. On two cores every flight was thought late by them."""


def steps_up_to(most: int) -> tuple[int, ...]:
    """Return the sizes there are, the largest of them `most`."""
    return (*(step for step in STEPS if step < most), most)


class PictureSize:
    """Choose the edge of the square picture, frame by frame.

    `want` may be called by any thread, all else by the one that draws.
    """

    def __init__(self, most: int) -> None:
        """Begin; most: the largest edge there may be, pixels."""
        self._steps = steps_up_to(most)
        self.first = self._step_for(min(most, FIRST_PX))
        """What the flight begins with."""
        self.prepare: Callable[[int], None] | None = None
        """Makes what a size needs before its first frame; called by another thread."""
        self._size = self._moving = self.first
        self._wanted = self.first
        self._limit = self.first
        self._is_late = False
        self._ready = {self.first}
        self._making: threading.Thread | None = None
        self._taken: deque[tuple[float, float]] = deque()
        self._unjudged = BEGINNING
        self._changed_s: float | None = None
        self._fixed = float(FIXED_PX**2)
        self._before: tuple[int, float] | None = None
        self._tried_s = -math.inf
        self._median_ms = math.inf
        self._rests = 0
        self._is_sharp = self._is_drawn = False

    @property
    def size(self) -> int:
        """Return the edge of the picture that was chosen last."""
        return self._size

    @property
    def told(self) -> str:
        """Return what to say of the size: whether it is as wanted, or frames are late.

        May be asked by any thread.
        """
        if self.is_late:
            return f"picture {self._size} of {self._wanted} px: frames were late"
        return f"picture {self._size} px"

    @property
    def is_late(self) -> bool:
        """Return whether less is drawn than is wanted, as frames were late.

        May be asked by any thread.
        """
        return self._is_late and self._size < self._wanted

    def want(self, edge_px: int) -> None:
        """Ask for a picture that fills so many pixels of the screen."""
        self._wanted = self._step_for(edge_px)

    def took(self, frame_ms: float, now_s: float) -> None:
        """Hear how long the last frame took to draw, without waiting for its pose."""
        if self._is_sharp and not self._is_drawn:
            self._is_drawn = True
            return
        self._rests, self._is_sharp = 0, False
        if self._unjudged:
            self._unjudged -= 1
            # a scope that rests from the beginning is shown sharper, too
            self._median_ms = min(self._median_ms, frame_ms)
            return
        taken = self._taken
        if self._changed_s is None:
            self._changed_s = now_s
        taken.append((now_s, frame_ms))
        while len(taken) > LOOKED_AT and taken[0][0] < now_s - LOOKED_S:
            taken.popleft()
        if len(taken) < LOOKED_AT or now_s < self._changed_s + LOOKED_S:
            return
        median_ms = sorted(each for _, each in taken)[len(taken) // 2]
        self._median_ms = median_ms
        self._learn(median_ms, now_s)
        goal = self._largest(median_ms, now_s)
        if goal != self._size:
            self._before = self._size, median_ms
            self._limit, self._is_late = goal, goal < self._wanted
            self._look_anew()

    def rested(self) -> None:
        """Hear that the last frame showed what the one before it did, at no cost."""
        self._rests += 1

    def next(self) -> int:
        """Return the edge of the picture to be drawn now."""
        goal = min(self._wanted, self._limit)
        rests = self._rests >= RESTS and goal < self._wanted
        if rests:
            goal = self._sharp()
        if goal != self._size and self._has(goal):
            self._size = goal
            self._unjudged = SETTLING
            self._is_sharp, self._is_drawn = rests and goal > self._moving, False
            if not self._is_sharp and goal != self._moving:
                self._moving = goal
                self._look_anew()
        return self._size

    def _look_anew(self) -> None:
        """Judge no frame that was drawn before now."""
        self._taken.clear()
        self._changed_s = None

    def _learn(self, median_ms: float, now_s: float) -> None:
        """Learn how much of a frame is fixed, from what two sizes took."""
        if self._before is None or self._before[0] == self._size:
            return
        (edge, before_ms), self._before = self._before, None
        few, many = sorted(((edge, before_ms), (self._size, median_ms)))
        more_ms, pixels = many[1] - few[1], many[0] ** 2 - few[0] ** 2
        fixed = float(MOST_FIXED_PX**2)
        if more_ms > 0.0:
            fixed = min(few[1] * pixels / more_ms - few[0] ** 2, fixed)
        self._fixed, self._tried_s = max(fixed, 0.0), now_s

    def _largest(self, median_ms: float, now_s: float) -> int:
        """Return the largest size that is wanted and in time."""
        size, most_ms = self._size, IN_TIME_SHARE * DUE_MS
        steps = [step for step in self._steps if step <= self._wanted]
        larger = [step for step in steps if step > size]
        if median_ms < most_ms:
            good = [s for s in larger if self._would_take(s, median_ms) < most_ms]
            if not good and larger and now_s > self._tried_s + TRIED_AFTER_S:
                good = larger[:1]
            return max(good, default=size)
        if median_ms <= DUE_MS:
            return size
        less = [step for step in steps if step < size]
        due = [s for s in less if self._would_take(s, median_ms) <= DUE_MS]
        return max(due, default=self._steps[0])

    def _would_take(self, step: int, median_ms: float) -> float:
        """Return what a frame of another size would take, ms."""
        return median_ms * (step**2 + self._fixed) / (self._moving**2 + self._fixed)

    def _sharp(self) -> int:
        """Return the largest size that is wanted and can be drawn once."""
        larger = [s for s in self._steps if self._moving < s <= self._wanted]
        soon = [s for s in larger if self._would_take(s, self._median_ms) <= SHARP_MS]
        return max(soon, default=self._moving)

    def _step_for(self, edge_px: int) -> int:
        """Return the smallest size that fills so many pixels, or the largest."""
        return next((s for s in self._steps if s >= edge_px), self._steps[-1])

    def _has(self, size: int) -> bool:
        """Return whether a size can be drawn at once; else have it made ready."""
        if self.prepare is None or size in self._ready:
            return True
        if self._making is None or not self._making.is_alive():
            self._making = threading.Thread(
                target=self._make_ready, args=(size,), name="picture size", daemon=True
            )
            self._making.start()
        return False

    def _make_ready(self, size: int) -> None:
        if self.prepare is not None:
            self.prepare(size)
        self._ready.add(size)
