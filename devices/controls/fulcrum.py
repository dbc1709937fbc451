"""Motion of a rigid scope through the nostril.

The nostril holds the shaft: whatever the hand does, the shaft's line passes through
one point, the fulcrum. Four freedoms are left: how deep the tip is, how the shaft tilts
to the side and upwards, how it turns about itself.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from devices.cross import cross
from system import UserError

SUPERIOR = (0.0, 0.0, 1.0)

LAG_S = 0.15
"""A hand that asks for more than the rate limit is followed for this long after it
stops; what would come later than that is not what it meant."""

SETTLING = 2.0
"""A shaft that was placed goes to the pivot so many times as fast as a hand may ask:
it gets there while the hand goes on."""

LEVER_MM = 20.0
"""A shaft that is less deep than this is held by the hand, that far behind its tip."""

LEANS_FROM_MM, LEANS_AHEAD_MM = 5.0, 6.0
"""A hand lays a shaft to another side of the nostril once it is so deep, for where its
tip goes next: what holds it may lie in the nostril."""

STILL_SHARE, WEDGED_S = 0.1, 0.8
"""A shaft that goes less than this share of what is asked for so long is wedged."""


LEANT_MM = 10.0
"""Over so much of its way in a shaft that is laid is leant to its side."""

DRAWN_MORE_MM = 8.0
"""A shaft that cannot be turned to where it is to lie is drawn back so much more."""


class Demand(NamedTuple):
    """What the hand asks for over one step; positive is in, right, up, clockwise.

    Rates are shares of the limit, -1 to 1. Nudges are way to go: mm for insert, degrees
    for the rest. Clockwise is as seen along the scope, from the eye.
    """

    insert: float = 0.0
    yaw: float = 0.0
    pitch: float = 0.0
    roll: float = 0.0
    insert_nudge_mm: float = 0.0
    yaw_nudge_deg: float = 0.0
    pitch_nudge_deg: float = 0.0
    roll_nudge_deg: float = 0.0


@dataclass(frozen=True, slots=True)
class FulcrumLimits:
    """How far the anatomy lets the scope move, and how fast a hand may move it.

    depth_mm: least and greatest way of the tip beyond the fulcrum.
    cone_deg: greatest tilt away from the fulcrum's axis.
    """

    depth_mm: tuple[float, float] = (0.0, 110.0)
    cone_deg: float = 35.0
    insert_mm_s: float = 25.0
    turn_deg_s: float = 25.0
    roll_deg_s: float = 90.0

    def __post_init__(self) -> None:
        low, high = self.depth_mm
        if not (math.isfinite(low) and math.isfinite(high) and 0.0 <= low < high):
            raise UserError(
                f"depth_mm must rise from 0 or more, got {low:g} to {high:g}"
            )
        if not 0.0 < self.cone_deg < 90.0:
            raise UserError(
                f"cone_deg must lie between 0 and 90, got {self.cone_deg:g}"
            )
        for name in ("insert_mm_s", "turn_deg_s", "roll_deg_s"):
            rate = getattr(self, name)
            if not (math.isfinite(rate) and rate > 0.0):
                raise UserError(f"{name} must be finite and positive, got {rate:g}")


@dataclass(frozen=True, slots=True, eq=False)
class Fulcrum:
    """The point that holds the shaft, and the middle of the ways through it.

    up: the direction that is up in the picture at roll zero.
    """

    pivot_mm: NDArray[np.float64]
    """(3,) mm."""
    axis: NDArray[np.float64]
    """(3,) unit vector into the body."""
    up: NDArray[np.float64] = field(default_factory=lambda: np.array(SUPERIOR))

    def __post_init__(self) -> None:
        for name in ("pivot_mm", "axis", "up"):
            vector = np.array(getattr(self, name), dtype=np.float64)
            if vector.shape != (3,) or not np.isfinite(vector).all():
                raise UserError(f"{name} must be three finite numbers, got {vector}")
            if name != "pivot_mm":
                length = float(np.linalg.norm(vector))
                if length == 0.0:
                    raise UserError(f"{name} must have a direction, got {vector}")
                vector /= length
            vector.flags.writeable = False
            object.__setattr__(self, name, vector)


@dataclass(slots=True, eq=False)
class _Lay:
    """Where a shaft is to lie: see `FulcrumControl.lay`; is_turned: it does."""

    entry_mm: NDArray[np.float64]
    depth_mm: float
    tilt_deg: NDArray[np.float64]
    roll_deg: float
    drawn_mm: float
    is_turned: bool = False
    still_s: float = 0.0
    least_s: float = math.inf


Hold = Callable[[NDArray[np.float64], NDArray[np.float64]], NDArray[np.float64]]
"""Gives the tip frame, 4x4, that a scope gets to from one frame on its way to another:
walls may hold it. It returns the wanted frame itself where nothing does."""

Lean = Callable[[NDArray[np.float64]], NDArray[np.float64]]
"""Gives the place in the nostril, (3,), where a hand lays a shaft whose tip is at one:
a nostril is wide and soft."""


class FulcrumControl:
    """Move a scope about a fulcrum; lengths in mm, in the frame of the fulcrum.

    For every sequence of demands the shaft's line passes through the pivot, depth and
    tilt stay within the limits and no step is faster than the limits. A demand that is
    not finite is refused and changes nothing. Where a hand leans the shaft the pivot
    moves as the hand does, no faster than it may turn: a hand at rest moves nothing.
    Where walls hold the scope the nostril gives way, and the hand goes on from where
    the scope was held. It can be drawn back at all times: along its own line, where it
    lies already, if no other way is free.
    """

    def __init__(
        self,
        fulcrum: Fulcrum,
        limits: FulcrumLimits | None = None,
        depth_mm: float | None = None,
        hold: Hold | None = None,
        lean: Lean | None = None,
    ) -> None:
        """Start in the middle of the cone, at the least depth or the one given.

        Raises UserError when the depth is out of the limits, or when the cone reaches
        the "up" direction, where there is no upright picture.
        """
        self.fulcrum = fulcrum
        self._hold = hold
        self._lean = lean
        self.entry_mm = fulcrum.pivot_mm
        """Where the shaft's line passes the nostril, (3,)."""
        self._held: NDArray[np.float64] | None = None
        self.limits = FulcrumLimits() if limits is None else limits
        low, high = self.limits.depth_mm
        self.depth_mm = low if depth_mm is None else depth_mm
        """How far the tip is beyond the fulcrum."""
        if not low <= self.depth_mm <= high:
            raise UserError(
                f"depth_mm must lie between {low:g} and {high:g}, got {depth_mm}"
            )
        right = np.cross(fulcrum.axis, fulcrum.up)
        aside = math.degrees(math.asin(min(float(np.linalg.norm(right)), 1.0)))
        if aside < self.limits.cone_deg + 5.0:
            raise UserError(
                f"a cone of {self.limits.cone_deg:g} degrees about an axis "
                f"{aside:.1f} degrees from the vertical reaches it; narrow the cone"
            )
        self._right = right / np.linalg.norm(right)
        self._up = np.cross(self._right, fulcrum.axis)
        # Degrees to the right and up, along great circles from the axis.
        self._tilt_deg = np.zeros(2)
        self.roll_deg = 0.0
        """The turn about the shaft, right-handed about its direction."""
        self._owed = np.zeros(4)
        self.is_settling = False
        """Whether a shaft that was placed is still on its way to the pivot."""
        self._goes_out = False
        self._laid: _Lay | None = None
        self._still_s = 0.0

    @property
    def is_wedged(self) -> bool:
        """Return whether walls have held it for a while, whatever was asked for."""
        return self._still_s >= WEDGED_S

    @property
    def tilt_deg(self) -> float:
        """Return the angle between shaft and axis."""
        return math.hypot(*self._tilt_deg)

    @property
    def pointing(self) -> NDArray[np.float64]:
        """Return the unit direction from the hand to the tip, (3,)."""
        return self._pointing(self._tilt_deg)

    def _pointing(self, tilt_deg: NDArray[np.float64]) -> NDArray[np.float64]:
        angle = math.hypot(*tilt_deg)
        if angle == 0.0:
            return self.fulcrum.axis.copy()
        aside = tilt_deg[0] * self._right + tilt_deg[1] * self._up
        turn = math.radians(angle)
        mixed = math.cos(turn) * self.fulcrum.axis + (math.sin(turn) / angle) * aside
        unit: NDArray[np.float64] = mixed / np.linalg.norm(mixed)
        return unit

    def frame(self) -> NDArray[np.float64]:
        """Return the tip frame, (4, 4) float64: x right, y up, z back up the shaft."""
        if self._held is not None:
            return self._held
        return self._frame(self.depth_mm, self._tilt_deg)

    def _frame(
        self, depth_mm: float, tilt_deg: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        pointing = self._pointing(tilt_deg)
        right, up = self._level(pointing).T
        turn = math.radians(self.roll_deg)
        cosine, sine = math.cos(turn), math.sin(turn)
        frame = np.eye(4)
        frame[:3, 0] = cosine * right - sine * up
        frame[:3, 1] = cosine * up + sine * right
        frame[:3, 2] = -pointing
        frame[:3, 3] = self.entry_mm + depth_mm * pointing
        return frame

    def _level(self, pointing: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return what is right and up, (3, 2), where a shaft is not rolled."""
        right = cross(pointing, self.fulcrum.up)
        right /= np.linalg.norm(right)
        return np.stack([right, cross(right, pointing)], axis=1)

    def place(self, frame: NDArray[np.float64]) -> None:
        """Take over a shaft where it is, 4x4; the next frame is this one.

        Its line need not pass through the pivot. It turns there from then on, and goes
        to where the limits let it be, at `SETTLING` times the limits of rate.
        """
        self._aim_at(frame[:3, 3])
        self.roll_deg = 0.0
        level = self._frame(self.depth_mm, self._tilt_deg)
        right, up = (
            float(frame[:3, 0] @ level[:3, 0]),
            float(frame[:3, 0] @ level[:3, 1]),
        )
        self.roll_deg = math.degrees(math.atan2(-up, right))
        self._held = np.array(frame, dtype=np.float64)
        self.is_settling = True
        self.let_go()

    def let_go(self) -> None:
        """Owe nothing any more of what was asked for so far."""
        self._owed = np.zeros(4)

    def go_out(self) -> None:
        """Draw the shaft out to the least depth, whatever is asked for meanwhile.

        What is asked for inwards ends it.
        """
        self._goes_out, self._laid = True, None

    @property
    def is_laid(self) -> bool:
        """Return whether it is on its way to where it was told to lie."""
        return self._laid is not None

    def lay(
        self, frame: NDArray[np.float64], entry_mm: NDArray[np.float64], drawn_mm: float
    ) -> None:
        """Bring the shaft to a frame, 4x4, through a place in the nostril, (3,).

        It is drawn back to a depth of drawn_mm, turned there and put in. Walls hold it
        all the while. Whatever is asked for meanwhile ends it.
        """
        depth_mm, *tilt = self._along(frame[:3, 3] - entry_mm)
        level = self._level(-frame[:3, 2])
        right, up = frame[:3, 0] @ level[:, 0], frame[:3, 0] @ level[:, 1]
        roll_deg = math.degrees(math.atan2(-float(up), float(right)))
        self._goes_out = False
        drawn_mm = max(drawn_mm, self.limits.depth_mm[0])
        self._laid = _Lay(
            np.array(entry_mm), float(depth_mm), np.array(tilt), roll_deg, drawn_mm
        )

    def advance(self, step_s: float, demand: Demand) -> None:
        """Follow the demand for ``step_s`` seconds.

        Raises UserError, and stays where it is, for a step that is negative or a
        demand that is not finite.
        """
        if not (math.isfinite(step_s) and step_s >= 0.0):
            raise UserError(f"step_s must not be negative, got {step_s}")
        if not all(map(math.isfinite, demand)):
            raise UserError(f"a demand must be finite, got {demand}")
        limits = self.limits
        fastest = np.array(
            (
                limits.insert_mm_s,
                limits.turn_deg_s,
                limits.turn_deg_s,
                limits.roll_deg_s,
            )
        )
        if self._goes_out:
            asks_in = demand.insert > 0.0 or demand.insert_nudge_mm > 0.0
            aside_mm = float(np.linalg.norm(self.entry_mm - self.fulcrum.pivot_mm))
            is_out = self.depth_mm <= limits.depth_mm[0] and aside_mm < 1e-6
            self._goes_out = not (asks_in or is_out)
            if self._goes_out:
                demand = Demand(insert=-1.0)
                self.let_go()
        if self._laid is not None and not any(demand):
            self._go_to(self._laid, step_s)
            return
        self._laid = None
        # Only strokes are owed: a key that is let go asks for nothing any more.
        held = _limited(np.array(demand[:4]) * fastest * step_s, fastest * step_s)
        wanted = held + self._owed + np.clip(demand[4:], -1e6, 1e6)
        step = _limited(wanted, fastest * step_s)
        self._owed = _limited(wanted - step, fastest * LAG_S)
        start = np.array((self.depth_mm, *self._tilt_deg))
        place = self._bounded(start + step[:3])
        before = self.frame()
        self.roll_deg = math.remainder(self.roll_deg + float(step[3]), 360.0)
        self.depth_mm, self._tilt_deg = float(place[0]), place[1:]
        if self._lean is not None and step_s > 0.0 and np.any(step[:3]):
            share = min(float((np.abs(step[:3]) / fastest[:3]).max() / step_s), 1.0)
            self._move_pivot(self._lean, before[:3, 3], share * step_s)
        if self.is_settling:
            self._settle(before, SETTLING * step_s)
        elif self._hold is not None and np.any(step):
            # a hand at rest moves nothing
            self._go(self._hold, before, float(start[0] - place[0]))
        turned = math.radians(math.hypot(*(place[1:] - start[1:])))
        asked_mm = abs(float(place[0] - start[0])) + turned * LEVER_MM
        went_mm = float(np.linalg.norm(self.frame()[:3, 3] - before[:3, 3]))
        if went_mm > STILL_SHARE * asked_mm:
            self._still_s = 0.0
        elif asked_mm > 0.0:
            self._still_s += step_s

    def go_through_walls(self) -> None:
        """Go through walls from now on: what the scope is put into holds it."""
        self._hold = self._lean = None

    def _go_to(self, lay: _Lay, step_s: float) -> None:
        """Go on to where it is to lie: back, about, and in."""
        limits, before = self.limits, self.frame()
        # it is leant aside once it is in
        share = (self.depth_mm - LEANS_FROM_MM) / LEANT_MM
        entry = lay.entry_mm - self.fulcrum.pivot_mm
        off = self.fulcrum.pivot_mm + min(max(share, 0.0), 1.0) * entry - self.entry_mm
        tilts = lay.tilt_deg - self._tilt_deg
        rolls_deg = math.remainder(lay.roll_deg - self.roll_deg, 360.0)
        needed_s = max(
            float(np.linalg.norm(off)) / limits.insert_mm_s,
            math.hypot(*tilts) / limits.turn_deg_s,
            abs(rolls_deg) / limits.roll_deg_s,
        )
        if needed_s <= step_s and not lay.is_turned:
            lay.is_turned, lay.least_s = True, math.inf
        depth_mm = lay.depth_mm if lay.is_turned else min(lay.drawn_mm, self.depth_mm)
        most_mm, left_mm = limits.insert_mm_s * step_s, depth_mm - self.depth_mm
        went_mm = min(max(left_mm, -most_mm), most_mm)
        if lay.is_turned or went_mm > -most_mm:
            share = min(step_s / max(needed_s, 1e-9), 1.0)
            self.entry_mm = self.entry_mm + share * off
            self._tilt_deg = self._tilt_deg + share * tilts
            self.roll_deg += share * rolls_deg
        place = np.array((self.depth_mm + went_mm, *self._tilt_deg))
        place = self._bounded(place)
        self.depth_mm, self._tilt_deg = float(place[0]), place[1:]
        if self._hold is not None:
            self._go(self._hold, before, -went_mm)
        left_s = needed_s + abs(left_mm) / limits.insert_mm_s
        if left_s < lay.least_s - STILL_SHARE * WEDGED_S:
            lay.least_s, lay.still_s = left_s, 0.0
        lay.still_s += step_s
        is_there = lay.is_turned and left_s <= 2.0 * step_s
        if is_there or lay.still_s >= WEDGED_S:
            is_out = self.depth_mm <= limits.depth_mm[0]
            self._laid = None if is_there or lay.is_turned or is_out else lay
            # farther out there is more room
            lay.drawn_mm = max(self.depth_mm - DRAWN_MORE_MM, limits.depth_mm[0])
            lay.least_s, lay.still_s = math.inf, 0.0

    def _move_pivot(
        self, lean: Lean, before_mm: NDArray[np.float64], time_s: float
    ) -> None:
        """Lay the shaft where its tip goes freely from a place, for some time."""
        limits, depth_mm = self.limits, self.depth_mm
        if depth_mm <= LEANS_FROM_MM:
            # on its way out it comes back to the nostril's middle
            way = self.fulcrum.pivot_mm - self.entry_mm
            self.entry_mm = self.entry_mm + _shortened(way, limits.insert_mm_s * time_s)
            return
        tip_mm = self.entry_mm + depth_mm * self.pointing
        ahead = tip_mm - before_mm
        ahead *= LEANS_AHEAD_MM / max(float(np.linalg.norm(ahead)), 1e-9)
        way = lean(tip_mm + ahead) - self.entry_mm
        most_mm = math.radians(limits.turn_deg_s) * depth_mm * time_s
        self.entry_mm = self.entry_mm + _shortened(way, most_mm)
        self._aim_at(tip_mm)

    def _settle(self, before: NDArray[np.float64], step_s: float) -> None:
        """Go from a frame towards the one that passes through the pivot."""
        wanted = self._frame(self.depth_mm, self._tilt_deg)
        way_mm = float(np.linalg.norm(wanted[:3, 3] - before[:3, 3]))
        # a turn about the shaft is no way to the pivot: the hand asks for it
        across = cross(wanted[:3, 2], before[:3, 2])
        along = float(wanted[:3, 2] @ before[:3, 2])
        turn_deg = math.degrees(math.atan2(float(np.linalg.norm(across)), along))
        share = 1.0
        for way, rate in (
            (way_mm, self.limits.insert_mm_s),
            (turn_deg, self.limits.turn_deg_s),
        ):
            if way > rate * step_s:
                share = min(share, rate * step_s / way)
        self.is_settling = share < 1.0
        aim = _part_way(before, wanted, share) if share < 1.0 else wanted
        held = aim if self._hold is None else self._hold(before, aim)
        self._held = None if held is wanted else held
        if held is not aim:
            self._aim_at(held[:3, 3])

    def _aim_at(self, tip_mm: NDArray[np.float64]) -> None:
        """Let depth and tilt be those of a tip, as far as the limits let them."""
        place = self._bounded(self._along(tip_mm - self.entry_mm))
        self.depth_mm, self._tilt_deg = float(place[0]), place[1:]

    def _along(self, way: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return depth and tilts, (3,), of a shaft that goes a way, (3,)."""
        right, up = float(way @ self._right), float(way @ self._up)
        aside = math.hypot(right, up)
        angle_deg = math.degrees(math.atan2(aside, float(way @ self.fulcrum.axis)))
        share = angle_deg / aside if aside > 0.0 else 0.0
        return np.array((float(np.linalg.norm(way)), share * right, share * up))

    def _go(self, hold: Hold, before: NDArray[np.float64], back_mm: float) -> None:
        """Go on from where walls hold the scope on its way from a frame.

        back_mm: so far it is drawn back, less than 0 for in.
        """
        wanted = self._frame(self.depth_mm, self._tilt_deg)
        held = hold(before, wanted)
        if held is wanted:
            self._held = None
            return
        back = before[:3, 2]
        went_mm = float((held[:3, 3] - before[:3, 3]) @ back)
        if back_mm > 0.0 and went_mm < back_mm / 2.0:
            held = before.copy()
            held[:3, 3] += back_mm * back
        self._held = held
        # the hand is where it wanted to be, the tip is not
        lever_mm = max(self.depth_mm, LEVER_MM)
        way = held[:3, 3] - (wanted[:3, 3] + lever_mm * wanted[:3, 2])
        place = self._along(way)
        place[0] += self.depth_mm - lever_mm
        place = self._bounded(place)
        self.depth_mm, self._tilt_deg = float(place[0]), place[1:]

    def _bounded(self, place: NDArray[np.float64]) -> NDArray[np.float64]:
        """Cut depth and tilts, (3,), down to the limits."""
        low, high = self.limits.depth_mm
        depth_mm = min(max(float(place[0]), low), high)
        return np.array((depth_mm, *_shortened(place[1:], self.limits.cone_deg)))


def _limited(
    way: NDArray[np.float64], most: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Cut ways of insertion, tilt (both together) and roll down to ``most``."""
    cut = np.clip(way, -most, most)
    cut[1:3] = _shortened(way[1:3], float(most[1]))
    return cut


def _shortened(vector: NDArray[np.float64], most: float) -> NDArray[np.float64]:
    length = math.hypot(*vector)
    if length <= most:
        return vector.copy()
    # Rounding must not leave it a hair too long: a limit is a limit.
    short: NDArray[np.float64] = vector * (most / length * (1.0 - 1e-15))
    return short


def _part_way(
    start: NDArray[np.float64], end: NDArray[np.float64], share: float
) -> NDArray[np.float64]:
    """Return a rigid 4x4 pose a share of the way from one to another."""
    mixed = start + share * (end - start)
    back = mixed[:3, 2] / np.linalg.norm(mixed[:3, 2])
    right = mixed[:3, 0] - (mixed[:3, 0] @ back) * back
    right /= np.linalg.norm(right)
    frame = np.eye(4)
    frame[:3, 0], frame[:3, 1], frame[:3, 2] = right, cross(back, right), back
    frame[:3, 3] = mixed[:3, 3]
    return frame
