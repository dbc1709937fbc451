"""How large the endoscope's picture is drawn: as on the screen, less where it is late.

A picture larger than its place on the screen costs time that nobody sees; one smaller
is blurred. The target is 30 frames a second at every size: the largest size that meets
it is drawn, however many frames a smaller one would give. Where a machine cannot draw
the size that is wanted in time, less is drawn, which is told, and a step more is tried
when there is time again.

Much of a frame has nothing to do with its pixels: poses, touch, the other panels. How
much is known only from trying, so a step more is tried wherever the size of now is in
time, ever more seldom where that was late.
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

LOOKED_AT, LOOKED_S = 12, 1.0
"""Frames whose median is judged, at least, and over how long: a late frame changes
nothing, and neither does a picture of the overview, which takes up to 0.4 s."""

IN_TIME_SHARE = 0.95
"""A step more is tried where a frame takes less than so much of the time."""

FIXED_PX = 378
"""Edge of the square whose pixels cost as much as what is done once a frame: discs,
lights, the starting of threads. Frames of the bundled flight took 20.6, 28.8, 39.7,
72.8 and 117.6 ms of a busy machine's processors at 256, 384, 512, 768 and 1,024
pixels: 14.1 ms and 98.7 ms a megapixel, within 1 %. More may be fixed, never less, so
this is the most that pixels can cost: several steps more are taken at once where even
so there is time, several less where even so there would be none between."""

DOUBTED = 1.15
"""It is taken for late by so little only where it was not in time before."""

UP_AFTER_S = 1.0
"""So long there must have been time before a larger picture is tried."""

AGAIN_AFTER_S = 10.0
"""A size that was late is tried again after so long, and then after twice as long. One
that was in time for as long as it was waited for begins anew."""

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
        self._in_time = 0
        self._ready = {self.first}
        self._making: threading.Thread | None = None
        self._taken: deque[tuple[float, float]] = deque()
        self._unjudged = BEGINNING
        self._changed_s: float | None = None
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
        taken = self._taken
        if self._changed_s is None:
            self._changed_s = now_s
        taken.append((now_s, frame_ms))
        while len(taken) > LOOKED_AT and taken[0][0] < now_s - LOOKED_S:
            taken.popleft()
        if len(taken) < LOOKED_AT or now_s < self._changed_s + LOOKED_S:
            return
        median_ms = sorted(each for _, each in taken)[len(taken) // 2]
        if median_ms > DUE_MS:
            self._be_late(median_ms, now_s)
        else:
            self._be_early(median_ms, now_s)

    def next(self) -> int:
        """Return the edge of the picture to be drawn now."""
        goal = min(self._wanted, self._limit)
        if goal != self._size and self._has(goal):
            self._size = goal
            self._unjudged = SETTLING
            self._look_anew()
        return self._size

    def _look_anew(self) -> None:
        """Judge no frame that was drawn before now."""
        self._taken.clear()
        self._changed_s = self._spare_since_s = None

    def _be_late(self, median_ms: float, now_s: float) -> None:
        """Draw a step less or, where that would not do, several; try again later."""
        size = self._size
        self._look_anew()
        if size == self._steps[0]:
            return
        wait_s = self._waits_s.get(size, AGAIN_AFTER_S)
        self._waits_s[size] = 2.0 * wait_s
        self._late_until_s[size] = now_s + wait_s
        less = [step for step in self._steps if step < size]
        if size <= self._in_time:
            self._in_time = 0
        # of what was in time a moment ago pixels may cost more than is known
        due = [
            step
            for step in less
            if self._at_most_ms(step, median_ms)
            <= DUE_MS * (DOUBTED if step == self._in_time else 1.0)
        ]
        self._limit = due[-1] if due else less[0]
        self._is_late = True

    def _be_early(self, median_ms: float, now_s: float) -> None:
        """Draw more when there has been time for long enough."""
        size = self._size
        waited_s = self._waits_s.get(size, 0.0)
        if self._changed_s is not None and now_s > self._changed_s + waited_s:
            self._waits_s.pop(size, None)
        more = self._free_above(size, median_ms, now_s)
        if more is None:
            self._spare_since_s = None
            return
        if self._spare_since_s is None:
            self._spare_since_s = now_s
        if now_s - self._spare_since_s >= UP_AFTER_S:
            self._limit, self._in_time = more, size
            self._is_late = more < self._wanted and self._is_late

    def _free_above(self, size: int, median_ms: float, now_s: float) -> int | None:
        """Return the larger size to try: the next, or the largest sure to be in time.

        None where there is no time, or none that may be tried again already.
        """
        most_ms = IN_TIME_SHARE * DUE_MS
        found = None
        for step in self._steps:
            if median_ms >= most_ms or step > self._wanted:
                break
            if step <= size:
                continue
            is_sure = self._at_most_ms(step, median_ms) < most_ms
            if now_s < self._late_until_s.get(step, now_s) or not (
                is_sure or found is None
            ):
                break
            found = step
        return found

    def _at_most_ms(self, step: int, median_ms: float) -> float:
        """Return what a frame of another size takes if no more is fixed than is known.

        That is the most of a larger size, and the least of a smaller one.
        """
        fixed = FIXED_PX**2
        return median_ms * (step**2 + fixed) / (self._size**2 + fixed)

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
