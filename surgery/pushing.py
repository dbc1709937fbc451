"""Tissue that gives way to tools: it yields, springs back, or stays where it was put.

The truth of an operation is the carved distance at rest. What is shown is that field
bent, in boxes around the tools; books, injuries and hashes know nothing of it. Mucosa
yields before a tool and springs back when it leaves. A turbinate that is pushed farther
than it yields goes along with the tool and stays, as when it is medialised.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from anatomy.tissue import Label
from anatomy.wall_layers import NO_WALL
from devices.cross import cross
from renderers.scene import AirSurface, Change, ChangeKind, RestOffsets
from surgery.kernels.bend_field import (
    CAP_ROWS,
    Dent,
    Dents,
    Grid,
    bend_box,
    measure_dent,
    rest_places,
)
from surgery.patient import OperatedPatient
from system import UserError

SPRING_S = 0.18
"""Time constant with which mucosa springs back; swollen tissue takes longer."""

GONE_MM = 0.02
"""A dent that is shallower than this is no more."""

YIELD_MM = 0.5
"""Depth of a dent beyond which a turbinate goes along with the tool."""

FARTHEST_MM = 3.6
"""A shift's length at most: with `RADIUS_MM` its map stays one to one."""

RADIUS_MM = 6.0
"""Radius of the ball in which a shift fades out."""

NEAR_MM = 3.5
"""A push so near to an older one continues it."""

MOST_SHIFTS = 8
"""Pushes that are remembered; the oldest is then continued by what is nearest."""

WHOLE_MM = 1.0
"""Tissue within this of a tool moves as a whole, so that no thinner wall gets thinner
by a dent."""

BESIDE_BONE = 0.7
"""Share of its thickness that mucosa on bone gives way."""

LONGEST_MM = 9.0
"""Part of a tool, from its tip, that tissue gives way to."""

FADING = 3.0
"""Depths of a dent over which it fades out beyond that, and `LEAST_FADING_MM` at least:
tissue there is pressed together to three fifths of its thickness at most."""

LEAST_FADING_MM = 1.0

_ROW_MM = 0.75
JOINT_MM = 2 * _ROW_MM
"""The dent of a part of a tool fades out over this beyond its end, and bends no tool
more than by a fraction of its radius there."""

_COLUMNS = 16
_ROWS = CAP_ROWS + round(LONGEST_MM / _ROW_MM) + 1

_MOBILE = (
    Label.INFERIOR_TURBINATE,
    Label.MIDDLE_TURBINATE,
    Label.SUPERIOR_TURBINATE,
    Label.TURBINATE_BONE,
)


@dataclass(frozen=True, slots=True)
class ToolCapsule:
    """Describe the round end of a tool.

    tip_mm: ``(3,)`` LPS, centre of its end ball. back: ``(3,)`` unit, along the shaft
    away from the tip. radius_mm: of ball and shaft. length_mm: from the ball's centre
    on, at most `LONGEST_MM`; it fades out over the last `JOINT_MM`. behind: what comes
    then, where the tool is bent; of that what is behind it is not looked at.
    """

    tip_mm: NDArray[np.float64]
    back: NDArray[np.float64]
    radius_mm: float
    length_mm: float = LONGEST_MM
    behind: "ToolCapsule | None" = None

    @classmethod
    def of(cls, tip_mm: ArrayLike, back: ArrayLike, radius_mm: float) -> "ToolCapsule":
        """Check and make a straight one; UserError for what is no end of a tool."""
        tip = np.asarray(tip_mm, np.float64)
        axis = np.asarray(back, np.float64)
        length = float(np.linalg.norm(axis))
        if not (np.all(np.isfinite(tip)) and math.isfinite(length) and length > 0):
            raise UserError(
                f"a tool needs a finite place and direction, got {tip}, {axis}"
            )
        if not 0.2 <= radius_mm <= 4.0:
            raise UserError(
                f"tissue gives way to tools of 0.2 to 4 mm radius, got {radius_mm} mm"
            )
        return cls(tip, axis / length, float(radius_mm))

    @classmethod
    def along(cls, places_mm: ArrayLike, radius_mm: ArrayLike) -> "ToolCapsule":
        """Make one along two or three places, the tip first; UserError as `of`.

        radius_mm: of each part between two places. The last goes on as a shaft.
        """
        places = np.asarray(places_mm, np.float64)
        radii = np.asarray(radius_mm, np.float64)
        if places.shape not in ((2, 3), (3, 3)) or len(radii) != len(places) - 1:
            raise UserError(
                "a tool's end has one or two parts, two or three places of three "
                f"numbers, got {places.shape} and {len(radii)} radii"
            )
        rods = [
            cls.of(begin, end - begin, radius)
            for begin, end, radius in zip(places, places[1:], radii, strict=False)
        ]
        if len(rods) == 1:
            return rods[0]
        first = float(np.linalg.norm(places[1] - places[0]))
        return replace(
            rods[0],
            length_mm=min(first + JOINT_MM, LONGEST_MM),
            behind=replace(rods[1], length_mm=max(LONGEST_MM - first, JOINT_MM)),
        )


@dataclass(frozen=True, slots=True)
class _Spring:
    """A dent that nothing holds any more, and since when."""

    dents: tuple[Dent, Dent]
    since_s: float


@dataclass(frozen=True, slots=True)
class PushingState:
    """What is bent at one moment: what stays, and what is held or springs back."""

    shifts: NDArray[np.float64]
    held: tuple[Dent, Dent]
    springing: tuple[Dent, Dent]
    spring: _Spring | None


class Pushing:
    """Bend what is shown of a patient, by recorded samples of tools alone.

    surface: what is to be drawn. What changes of it is this object's: its distance, the
    pristine one, film and pallor of its wounds, and where it lies at rest. `show` and
    `show_blood` edit them in place, and nothing else does. shifts: ``(n, 7)`` float64,
    the record of what stays bent: middle, shift and radius, mm LPS.

    A wall of two voxels may show a hole where a tool thicker than 1.4 mm lies flat and
    deep in it; at rest it has none.
    """

    def __init__(self, patient: OperatedPatient) -> None:
        wounds = patient.surface.wounds
        assert wounds is not None
        self._patient = patient
        distance = patient.surface.distance
        self._rest = distance.values, wounds.pristine.values
        self._shown = distance.values.copy(), wounds.pristine.values.copy()
        carved, pristine = self._shown
        self._blood = [
            (each.values, _own(each.values))
            for each in (wounds.film, wounds.pale)
            if each is not None
        ]
        # pages of which nothing is ever pushed take no memory
        aside, back, up = (np.zeros(carved.shape, np.float32) for _ in range(3))
        self._offsets = aside, back, up
        self._reach = np.zeros(6, np.float32)
        x, y, z = (distance.with_values(axis, 0.0) for axis in self._offsets)
        self.surface: AirSurface = replace(
            patient.surface,
            distance=distance.with_values(carved, distance.background),
            wounds=replace(
                wounds,
                pristine=wounds.pristine.with_values(pristine, distance.background),
                film=wounds.film.with_values(self._blood[0][1], 0),
                pale=None
                if wounds.pale is None
                else wounds.pale.with_values(self._blood[1][1], 0),
            ),
            rest=RestOffsets(wounds.pristine, x, y, z, self._reach),
        )
        self.shifts: NDArray[np.float64] = np.empty((0, 7))
        self._grid = Grid(
            np.ascontiguousarray(distance.world_from_voxel[:3]),
            np.ascontiguousarray(distance.voxel_from_world[:3]),
        )
        self._held = self._springing = _no_dents()
        self._spring: _Spring | None = None
        self._unshown: list[NDArray[np.int64] | None] = []
        kinds = patient.layers.kinds
        self._mobile_rows = np.array(
            [k.mucosa in _MOBILE or k.bone in _MOBILE for k in kinds]
        )

    def take_in(self, time_s: float, rod: ToolCapsule | None) -> bool:
        """Take in one sample: tissue gives way to a tool, or springs back from it.

        Samples come in order of time. rod: None where no tool is. `show` shows it.
        Returns whether anything is bent, or was before.
        """
        before = self._dented()
        was = self._held
        self._held = self._measured(rod) if rod is not None else _no_dents()
        if rod is not None and self._shift(rod):
            # the tissue that goes along with the tool is dented less
            self._unshown.append(self._ball(self.shifts[-1]))
            self._held = self._measured(rod)
        if _deep(was) > 0 and _deep(self._held) == 0:
            self._spring = _Spring(was, time_s)
        self._springing = self._sprung(time_s)
        boxes = [box for box in (*before, *self._dented()) if box is not None]
        self._unshown += boxes
        return bool(boxes)

    def take_in_edit(self, change: Change) -> None:
        """Take in an edit of the patient; `show` shows it."""
        reach = self._farthest_mm() / self._patient.surface.distance.spacing_mm
        low = np.floor(change.low - reach).astype(np.int64)
        high = np.ceil(change.high + reach).astype(np.int64)
        self._unshown.append(self._clipped(np.concatenate([low, high + 1])))

    def show(
        self, generation: int, kind: ChangeKind = ChangeKind.DENT
    ) -> Change | None:
        """Show all that was taken in; returns what is shown otherwise now, if anything.

        Between two calls nothing that is shown changes: whoever draws it has the time.
        generation, kind: of the change.
        """
        box, self._unshown = _union(self._unshown), []
        return self._bend(box, generation, kind)

    def show_blood(self, changes: Iterable[Change]) -> None:
        """Show the patient's film and pallor where they changed."""
        for low, high in ((change.low, change.high) for change in changes):
            here = tuple(slice(low[a], high[a] + 1) for a in (2, 1, 0))
            for lies, shown in self._blood:
                shown[here] = lies[here]

    def push(
        self, time_s: float, generation: int, rod: ToolCapsule | None
    ) -> Change | None:
        """Take in one sample and show it: see `take_in` and `show`."""
        self.take_in(time_s, rod)
        return self.show(generation)

    def follow(self, change: Change) -> Change:
        """Show an edit of the patient; returns what is shown otherwise, as a cut."""
        self.take_in_edit(change)
        return widened(change, self.show(change.generation, change.kind))

    def checkpoint(self) -> PushingState:
        """Return what is bent now."""
        return PushingState(
            self.shifts.copy(), self._held, self._springing, self._spring
        )

    def restore(self, state: PushingState) -> None:
        """Bend what was bent then, and nothing else; `show` shows it."""
        self._unshown += self._bent()
        self.shifts = state.shifts.copy()
        self._held, self._springing = state.held, state.springing
        self._spring = state.spring
        self._unshown += self._bent()

    def release(self, generation: int) -> Change | None:
        """Put everything back to rest, also what would stay."""
        self._unshown += self._bent()
        self.shifts = np.empty((0, 7))
        self._held = self._springing = _no_dents()
        self._spring = None
        return self.show(generation)

    @property
    def box(self) -> tuple[NDArray[np.int64], NDArray[np.int64]] | None:
        """Return the first and last voxel, i j k, that may be shown bent now."""
        box = _union(self._bent())
        return None if box is None else (box[:3], box[3:] - 1)

    def at_rest(
        self, points_mm: NDArray[np.float64], *, is_dented: bool = True
    ) -> NDArray[np.float64]:
        """Return where what is shown at ``(n, 3)`` places lies in the patient's fields.

        is_dented: False leaves dents out, for a tool that cuts: it holds what yields to
        it, and only what stays bent is elsewhere.
        """
        points = np.ascontiguousarray(points_mm, np.float64)
        found = np.empty_like(points)
        dents = self._dents() if is_dented else (*_no_dents(), *_no_dents())
        rest_places(points, self.shifts, dents, found)
        return found

    def _dents(self) -> Dents:
        (tip, behind), (sprung_tip, sprung) = self._held, self._springing
        return behind, tip, sprung, sprung_tip

    def _bent(self) -> list[NDArray[np.int64] | None]:
        """Return the voxels that each dent and each shift may move."""
        return [*self._dented(), *(self._ball(shift) for shift in self.shifts)]

    def _dented(self) -> list[NDArray[np.int64] | None]:
        """Return the voxels that each dent may move."""
        return [self._box_of(dent) for dent in self._dents()]

    def _measured(self, rod: ToolCapsule) -> tuple[Dent, Dent]:
        """Return the dents of a tool's tip and of what is behind it."""
        tip = self._measured_part(rod, _no_dent())
        if rod.behind is None:
            return tip, _no_dent()
        return tip, self._measured_part(rod.behind, tip)

    def _measured_part(self, rod: ToolCapsule, other: Dent) -> Dent:
        dent = _dent_of(rod)
        values = self._rest[0]
        measure_dent(values, self._grid.voxel, self.shifts, *dent, other)
        if not dent.depth.any():
            return dent
        point = _deepest(dent)
        depth = np.minimum(dent.depth, self._give_mm(point))
        size = dent.size.copy()
        size[4] = max(LEAST_FADING_MM, FADING * float(depth.max()))
        return Dent(dent.frame, size, depth)

    def _shift(self, rod: ToolCapsule) -> bool:
        """Let a turbinate go along with a tool that is too deep in it."""
        over = _deep(self._held) - YIELD_MM
        if over <= 0:
            return False
        part = self._held[0]
        if rod.behind is not None and self._held[1].depth.max() > part.depth.max():
            part, rod = self._held[1], rod.behind
        point = _deepest(part)
        if not self._is_mobile(point):
            return False
        # away from the axis of the tool, or forward from its tip
        along = max(float((point - rod.tip_mm) @ rod.back), 0.0)
        away = point - rod.tip_mm - along * rod.back
        step = over * away / np.linalg.norm(away)
        rows = self.shifts
        near = len(rows)
        if near:
            gaps = np.linalg.norm(rows[:, :3] + 0.5 * rows[:, 3:6] - point, axis=1)
            least = int(np.argmin(gaps))
            if gaps[least] < NEAR_MM or len(rows) >= MOST_SHIFTS:
                near = least
        row = np.array([*(point + away / np.linalg.norm(away)), 0, 0, 0, RADIUS_MM])
        if near < len(rows):
            row = rows[near].copy()
            rows = np.delete(rows, near, axis=0)
        row[3:6] += step
        length = float(np.linalg.norm(row[3:6]))
        row[3:6] *= min(1.0, FARTHEST_MM / length)
        self.shifts = np.concatenate([rows, row[None]])
        return True

    def _sprung(self, time_s: float) -> tuple[Dent, Dent]:
        """Return what is left of the dents that nothing holds."""
        if self._spring is None:
            return _no_dents()
        (tip, behind), since_s = self._spring.dents, self._spring.since_s
        left = math.exp(-max(time_s - since_s, 0.0) / SPRING_S)
        if max(tip.depth.max(), behind.depth.max()) * left < GONE_MM:
            self._spring = None
            return _no_dents()
        return (
            Dent(tip.frame, tip.size, tip.depth * left),
            Dent(behind.frame, behind.size, behind.depth * left),
        )

    def _voxel(self, point: NDArray[np.float64]) -> tuple[int, int, int]:
        """Return the voxel (k, j, i) of the patient's fields next to a shown place."""
        m = self._grid.voxel
        rest = self.at_rest(point[None], is_dented=False)[0]
        # clipped first: no voxel's number is as large as a far place
        top = np.array(self._rest[0].shape[::-1]) - 1
        at = np.clip(np.rint(m[:, :3] @ rest + m[:, 3]), 0, top)
        i, j, k = at.astype(np.int64).tolist()
        return k, j, i

    def _is_mobile(self, point: NDArray[np.float64]) -> bool:
        layers, voxel = self._patient.layers, self._voxel(point)
        row = int(layers.wall.values[voxel])
        ground = int(layers.ground.values[voxel])
        return ground in _MOBILE or bool(self._mobile_rows[row])

    def _give_mm(self, point: NDArray[np.float64]) -> float:
        """Return how far tissue gives way at most: mucosa on bone is held by it."""
        layers, voxel = self._patient.layers, self._voxel(point)
        row = int(layers.wall.values[voxel])
        kind = layers.kinds[row]
        if row == NO_WALL or kind.bone_mm == 0 or self._is_mobile(point):
            return math.inf
        return BESIDE_BONE * kind.mucosa_mm

    def _farthest_mm(self) -> float:
        """Return how far any tissue is shown from where it lies."""
        lengths = np.linalg.norm(self.shifts[:, 3:6], axis=1).sum()
        return float(lengths) + sum(float(dent.depth.max()) for dent in self._dents())

    def _bend(
        self, box: NDArray[np.int64] | None, generation: int, kind: ChangeKind
    ) -> Change | None:
        bent = self.box
        if bent is None:
            self._reach[:] = 0
        else:
            self._reach[:3], self._reach[3:] = bent[0] - 1, bent[1] + 1
        if box is None or np.any(box[3:] <= box[:3]):
            return None
        bounds = np.empty(6, np.int64)
        dents = self._dents()
        if not bend_box(
            self._rest,
            self._shown,
            self._grid,
            box,
            self.shifts,
            dents,
            bounds,
            self._offsets,
        ):
            return None
        return Change(generation, bounds[:3].copy(), bounds[3:].copy(), kind)

    def _box_of(self, dent: Dent) -> NDArray[np.int64] | None:
        """Return the voxels that a dent may move, ends excluded."""
        if not dent.depth.any():
            return None
        rows = np.flatnonzero(dent.depth.any(axis=1))
        frame, (radius, length, step, whole, fading) = dent.frame, dent.size
        ends = np.clip((rows[[0, -1]] - CAP_ROWS + (-1, 1)) * step, 0, length)
        reach = radius + whole + fading
        return self._around(frame[0] + ends[:, None] * frame[1], reach)

    def _ball(self, shift: NDArray[np.float64]) -> NDArray[np.int64]:
        return self._around(shift[None, :3], float(shift[6]))

    def _around(
        self, points: NDArray[np.float64], reach_mm: float
    ) -> NDArray[np.int64]:
        """Return the voxels within reach of places, ends excluded."""
        distance = self._patient.surface.distance
        at = points @ self._grid.voxel[:, :3].T + self._grid.voxel[:, 3]
        reach = reach_mm / distance.spacing_mm
        low = np.floor(at.min(axis=0) - reach)
        high = np.ceil(at.max(axis=0) + reach) + 1
        return self._clipped(np.concatenate([low, high]))

    def _clipped(
        self, box: NDArray[np.float64] | NDArray[np.int64]
    ) -> NDArray[np.int64]:
        top = np.array(self._rest[0].shape[::-1] * 2)
        clipped: NDArray[np.int64] = np.clip(box, 0, top).astype(np.int64)
        return clipped


def _own(values: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Copy an array; pages of nothing take no memory."""
    own = np.zeros(values.shape, values.dtype)
    if values.any():
        own[...] = values
    return own


def widened(change: Change, other: Change | None) -> Change:
    """Return a change that is as wide as both."""
    if other is None:
        return change
    low, high = np.minimum(change.low, other.low), np.maximum(change.high, other.high)
    return replace(change, low=low, high=high)


def _no_dent() -> Dent:
    # of no size: no place is within it
    return Dent(np.zeros((4, 3)), np.zeros(5), np.zeros((_ROWS, _COLUMNS)))


def _no_dents() -> tuple[Dent, Dent]:
    return _no_dent(), _no_dent()


def _deep(dents: tuple[Dent, Dent]) -> float:
    """Return how deep the deeper of two dents is, mm."""
    return max(float(dent.depth.max()) for dent in dents)


def _dent_of(rod: ToolCapsule) -> Dent:
    """Return the frame of a dent around a tool, without depth."""
    axis = rod.back
    side = np.zeros(3)
    side[int(np.argmin(np.abs(axis)))] = 1.0
    first = cross(axis, side)
    first /= np.linalg.norm(first)
    frame = np.stack([rod.tip_mm, axis, first, cross(axis, first)])
    length = rod.length_mm
    size = np.array([rod.radius_mm, length, _ROW_MM, WHOLE_MM, LEAST_FADING_MM])
    return Dent(frame, size, np.zeros((_ROWS, _COLUMNS)))


def _deepest(dent: Dent) -> NDArray[np.float64]:
    """Return the place on a tool that is deepest in tissue."""
    row, column = np.unravel_index(int(np.argmax(dent.depth)), dent.depth.shape)
    turn = 2 * math.pi * column / _COLUMNS
    rise = 0.5 * math.pi * max(1 - row / CAP_ROWS, 0.0)
    along = max(float(row) - CAP_ROWS, 0.0) * _ROW_MM
    tip, axis, first, second = dent.frame
    radial = math.cos(turn) * first + math.sin(turn) * second
    out = math.cos(rise) * radial - math.sin(rise) * axis
    place: NDArray[np.float64] = tip + along * axis + dent.size[0] * out
    return place


def _union(boxes: list[NDArray[np.int64] | None]) -> NDArray[np.int64] | None:
    """Return what holds all boxes."""
    held = [box for box in boxes if box is not None]
    if not held:
        return None
    low = np.min([box[:3] for box in held], axis=0)
    high = np.max([box[3:] for box in held], axis=0)
    return np.concatenate([low, high])
