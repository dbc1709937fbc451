"""What a scope or a tool meets: walls hold it where nothing pushes back on the hand.

Mouse and gamepad feel no wall. What they steer goes as far as tissue lets it, and
slides along (see `surgery.kernels.resolve_contact`). With an arm nothing is moved: its
scope is where it is, and a contact is shown and scored.
"""

import math

import numpy as np
from numpy.typing import NDArray

from devices.cross import cross
from renderers.scene import Volume
from surgery.kernels.distance_field import HOLE, DistanceField
from surgery.kernels.resolve_contact import resolve_contact
from system import UserError

Doubles = NDArray[np.float64]

APART_MM = 0.6
"""Between the balls of a shaft. One of 1.35 mm is 0.03 mm thinner between them."""

MOST_BALLS = 200

ITERATIONS = 12

SOFT = 1.0
"""The nostril gives way as readily as the tip: a stiffer one keeps a scope that lies on
the nostril's sill from much of what lies behind it."""

LEAST_LEVER_MM = 20.0
"""A shaft that is less deep than this is held by the hand outside."""

TURN_DEG = 1.0
"""Largest turn of a tool in one step: what lies 6 mm off its shaft moves by 0.1 mm."""

TURNED = 2
"""Times that a tool which walls have turned is looked at anew."""

NO_GUARD = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 1.0, -1.0])
"""No other shaft is in the way."""

MOST_TURNS = 12
"""Steps of one motion, at most: its time is bounded however far a hand jumps."""


class ShaftHold:
    """Straight shafts in front of walls, within bounded time.

    The same poses and the same tissue give the same poses, bit by bit. Tissue is read
    as it is at the time: what was cut away no longer holds.
    """

    def __init__(self, distance: Volume, pivot_mm: Doubles) -> None:
        """Take the air around a tool.

        distance: signed air distance, mm, negative in air; its values may be edited in
        place. pivot_mm: ``(3,)`` where the nostril holds the shaft. guard: ``(7,)``
        ends and radius of another shaft that is in the way, mm.
        """
        self.guard = NO_GUARD
        self._field = DistanceField(
            distance.values,
            np.ascontiguousarray(distance.voxel_from_world[:3]),
            float(distance.spacing_mm.max()),
            np.zeros((0, HOLE)),
        )
        self.pivot_mm = np.asarray(pivot_mm, np.float64)

    def held(
        self,
        start: Doubles,
        wanted: Doubles,
        balls: Doubles,
        grown: Doubles,
        give_mm: float,
    ) -> Doubles:
        """Return the pose that a shaft gets to, 4x4, on its way to a wanted one.

        balls, grown: as `surgery.kernels.resolve_contact` takes them. give_mm: how
        deep a wall is dented. The least gap is kept, or that depth: nothing is pushed
        deeper. The wanted pose itself is returned where nothing holds.
        """
        away = float(np.linalg.norm(self.pivot_mm - start[:3, 3]))
        lever = max(away, LEAST_LEVER_MM)
        rod, aim = _rod(start, lever), _rod(wanted, lever)
        resolve_contact(
            self._field,
            self.guard,
            balls,
            grown,
            lever,
            rod,
            aim,
            give_mm,
            SOFT,
            ITERATIONS,
        )
        if np.array_equal(rod, aim):
            return wanted
        return _frame(rod, wanted)


class ScopeHold(ShaftHold):
    """A scope: a straight shaft of one radius."""

    def __init__(
        self,
        distance: Volume,
        radius_mm: float,
        length_mm: float,
        pivot_mm: Doubles,
        give_mm: float,
    ) -> None:
        """Take the air around a scope; see `ShaftHold`.

        radius_mm, length_mm: of the shaft that is held. give_mm: how deep a wall is
        dented by a touch.
        """
        super().__init__(distance, pivot_mm)
        if not (0.0 < radius_mm < length_mm and np.isfinite(length_mm)):
            raise UserError(
                f"a shaft of {length_mm} mm must be longer than its radius of "
                f"{radius_mm} mm"
            )
        if not 0.0 <= give_mm < np.inf:
            raise UserError(f"give_mm must not be negative, got {give_mm}")
        count = min(int((length_mm - radius_mm) / APART_MM) + 2, MOST_BALLS)
        self._balls = np.zeros((count, 5))
        self._balls[:, 0] = np.linspace(radius_mm, length_mm, count)
        self._balls[:, 1] = radius_mm
        self._give_mm = give_mm
        # compiled, or fetched compiled, before the flight begins
        self(np.eye(4), np.eye(4))

    def __call__(self, start: Doubles, wanted: Doubles) -> Doubles:
        """Return the pose that a scope gets to, 4x4, on its way to a wanted one.

        start: where it is. Its least gap is kept, or the depth of a touch: it is never
        pushed deeper. A wanted pose that is not finite is refused: it stays.
        Pushed along a wall at one place, it may go to and fro by half a millimetre.
        """
        if not np.all(np.isfinite(wanted)):
            return start
        # what lies before the entrance is held by no passage: of a patient's own head
        # nobody knows the way through the face
        inside_mm = float(np.linalg.norm(self.pivot_mm - start[:3, 3]))
        balls = self._balls[: max(int(np.sum(self._balls[:, 0] <= inside_mm)), 1)]
        grown = np.zeros(len(balls))
        return self.held(start, wanted, balls, grown, self._give_mm)


class CapsuleHold(ShaftHold):
    """A tool that is made of capsules, bent ends and open jaws included."""

    def go(
        self,
        start: Doubles,
        wanted: Doubles,
        balls: Doubles,
        grown: Doubles,
        give_mm: float,
    ) -> Doubles:
        """Return the pose that a tool gets to, 4x4, on its way to a wanted one.

        balls: of `balls_along`, in the frame that is moved, whose +z runs back up the
        shaft; without any nothing holds it. grown: ``(n,)`` how much thicker they are
        for tissue, mm. A wanted pose that is not finite is
        refused. Far turns are gone in steps, `MOST_TURNS` at most.
        """
        if not np.all(np.isfinite(wanted)):
            return start
        if not len(balls) or not np.all(np.isfinite(start)):
            return wanted
        turn_deg = _turn_deg(start, wanted)
        steps = min(max(math.ceil(turn_deg / TURN_DEG), 1), MOST_TURNS)
        frame = start
        for left in range(steps, 0, -1):
            aim = wanted if left == 1 else between(frame, wanted, 1.0 / left)
            off = balls.copy()
            off[:, 2:] = balls[:, 2:] @ aim[:3, :3].T
            frame = self.held(frame, aim, off, grown, give_mm)
        if frame is wanted:
            return wanted
        # walls have turned it, too, and what lies off its line with it
        for _ in range(TURNED):
            off = balls.copy()
            off[:, 2:] = balls[:, 2:] @ frame[:3, :3].T
            frame = self.held(frame, frame, off, grown, give_mm)
        return frame


def balls_along(capsules: Doubles) -> Doubles:
    """Return the balls that capsules are made of: along z, radius, place off z.

    capsules: ``(n, 7)``; the balls ``(m, 5)``, at most `MOST_BALLS`, fine ones nearer
    to one another.
    """
    way = np.linalg.norm(capsules[:, 3:6] - capsules[:, :3], axis=1)
    apart = np.minimum(APART_MM, np.maximum(capsules[:, 6], 0.2))
    counts = np.ceil(way / apart).astype(np.int64) + 1
    if counts.sum() > MOST_BALLS:
        apart = apart * (way / apart).sum() / max(MOST_BALLS - 2 * len(way), 1)
        counts = np.ceil(way / apart).astype(np.int64) + 1
    rows = []
    for (*ends, radius), count in zip(capsules.tolist(), counts.tolist(), strict=True):
        places = np.linspace(ends[:3], ends[3:], count)
        made = np.zeros((count, 5))
        made[:, 0], made[:, 1] = places[:, 2], radius
        made[:, 2:4] = places[:, :2]
        rows.append(made)
    return np.concatenate(rows)


def between(start: Doubles, end: Doubles, share: float) -> Doubles:
    """Return a rigid 4x4 pose a share of the way from one to another.

    Origin, shaft and x axis go straight and are made square again.
    """
    mixed = start + share * (end - start)
    back = mixed[:3, 2] / np.linalg.norm(mixed[:3, 2])
    return _squared(back, mixed[:3, 0], mixed[:3, 3])


def _turn_deg(start: Doubles, end: Doubles) -> float:
    """Return the angle between two poses."""
    trace = float(np.sum(start[:3, :3] * end[:3, :3]))
    return math.degrees(math.acos(min(max((trace - 1.0) / 2.0, -1.0), 1.0)))


def _rod(frame: Doubles, lever: float) -> Doubles:
    """Return the tip and the shaft's point in the nostril, ``(6,)``."""
    return np.concatenate([frame[:3, 3], frame[:3, 3] + lever * frame[:3, 2]])


def _frame(rod: Doubles, wanted: Doubles) -> Doubles:
    """Return the pose of a rod, rolled as wanted."""
    back = rod[3:] - rod[:3]
    back /= np.linalg.norm(back)
    return _squared(back, wanted[:3, 0], rod[:3])


def _squared(back: Doubles, right: Doubles, tip: Doubles) -> Doubles:
    """Return the pose at a tip with a unit z axis, x as near to `right` as can be."""
    right = right - (right @ back) * back
    length = float(np.linalg.norm(right))
    if length < 1e-9:
        # half a turn lies between two poses: any way round is one
        right = np.cross(back, np.eye(3)[int(np.argmin(np.abs(back)))])
        length = float(np.linalg.norm(right))
    right /= length
    frame = np.eye(4)
    frame[:3, 0], frame[:3, 1], frame[:3, 2] = right, cross(back, right), back
    frame[:3, 3] = tip
    return frame
