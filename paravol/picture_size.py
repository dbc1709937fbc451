"""How large the endoscope's picture is drawn: as on the screen, less where it is late.

A picture larger than its place on the screen costs time that nobody sees; one smaller
is blurred. Where a machine cannot draw the size that is wanted in time, a step less is
drawn, which is told, and a step more when there is time again.
"""

import threading
from collections import deque
from collections.abc import Callable

STEPS = (256, 384, 512, 640, 768, 896, 1024, 1280, 1536, 2048)
"""Edges of pictures, pixels: a change costs a frame or so, so few are enough."""

FIRST_PX = 512
"""A flight begins with no more: whether there is time for more, it has yet to show."""

DUE_MS = 1000.0 / 30.0
"""Time for a frame: 30 frames a second look like a motion."""

LOOKED_AT = 12
"""Frames whose median is judged, so that a single late one changes nothing."""

SPARE_SHARE = 0.9
"""A larger picture is tried where it would take less than so much of the time. One that
is late all the same is given up after a dozen frames, and tried ever more seldom."""

GROWTH = 1.6
"""Power of the edge by which a frame's time grows. By CPU time a frame of the bundled
flight takes 18.8 ms at 512 pixels and 57.6 at 1,024: what is found once a frame, discs
and lights, does not grow. By the area, 1,024 pixels would be thought late where they
are not."""

UP_AFTER_S = 1.0
"""So long there must have been time before a larger picture is tried."""

AGAIN_AFTER_S = 10.0
"""A size that was late is tried again after so long, and then after twice as long."""

SETTLING = 3
"""Frames after a change that are not judged: memory of the new size is first used."""

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
        self._size = self.first
        self._wanted = self.first
        self._limit = self.first
        self._is_late = False
        self._ready = {self.first}
        self._making: threading.Thread | None = None
        self._taken_ms: deque[float] = deque(maxlen=LOOKED_AT)
        self._unjudged = BEGINNING
        self._spare_since_s: float | None = None
        self._late_until_s: dict[int, float] = {}
        self._waits_s: dict[int, float] = {}

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
        if self._unjudged:
            self._unjudged -= 1
            return
        self._taken_ms.append(frame_ms)
        if len(self._taken_ms) < LOOKED_AT:
            return
        median = sorted(self._taken_ms)[LOOKED_AT // 2]
        if median > DUE_MS:
            self._be_late(now_s)
        else:
            self._be_early(median, now_s)

    def next(self) -> int:
        """Return the edge of the picture to be drawn now."""
        goal = min(self._wanted, self._limit)
        if goal != self._size and self._has(goal):
            self._size = goal
            self._taken_ms.clear()
            self._unjudged = SETTLING
            self._spare_since_s = None
        return self._size

    def _be_late(self, now_s: float) -> None:
        """Draw a step less, and try the size again later."""
        size = self._size
        self._spare_since_s = None
        if size == self._steps[0]:
            return
        wait_s = self._waits_s.get(size, AGAIN_AFTER_S)
        self._waits_s[size] = 2.0 * wait_s
        self._late_until_s[size] = now_s + wait_s
        self._limit = self._steps[self._steps.index(size) - 1]
        self._is_late = True
        self._taken_ms.clear()

    def _be_early(self, median_ms: float, now_s: float) -> None:
        """Draw as many steps more as there has been time for long enough."""
        more = [
            step
            for step in self._steps
            if self._size < step <= self._wanted
            and now_s >= self._late_until_s.get(step, now_s)
            and median_ms * (step / self._size) ** GROWTH < SPARE_SHARE * DUE_MS
        ]
        if not more:
            self._spare_since_s = None
            return
        if self._spare_since_s is None:
            self._spare_since_s = now_s
        if now_s - self._spare_since_s >= UP_AFTER_S:
            self._limit = more[-1]
            self._is_late = more[-1] < self._wanted and self._is_late

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
