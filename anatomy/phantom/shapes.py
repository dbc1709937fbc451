"""Implicit shapes as expression trees over one side of the head.

A field maps points ``(u, y, z)`` in mm (u lateral distance from the septum, y towards
the front, z upwards) to a number, negative inside; most are close to a distance but
none has to be one. `Field.evaluate` is the plain meaning in numpy; `Field.encode`
writes the same tree as a stack program that the kernels run.

The smooth minimum is the quadratic polynomial one. It *equals* the minimum where its
arguments differ by its width or more, so parts out of reach can be left out without a
trace; blends by exponentials never can.
"""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from anatomy.phantom.program import Encoder, Op
from system import UserError

Array = NDArray[np.float64]
Point = tuple[float, float, float]

U, Y, Z = 0, 1, 2
"""The axes of one side, as `Table` names them."""


class Field(ABC):
    """Stand for one expression; build it from shapes and operators."""

    @abstractmethod
    def evaluate(self, points: Array) -> Array:
        """Return the values ``(n,)`` at ``(3, n)`` points, in the points' precision."""

    @abstractmethod
    def encode(self, encoder: Encoder) -> None:
        """Append the instructions that push this field's value."""

    def __add__(self, other: "Field | float") -> "Field":
        return _add(self, as_field(other), 1.0)

    def __radd__(self, other: float) -> "Field":
        return _add(as_field(other), self, 1.0)

    def __sub__(self, other: "Field | float") -> "Field":
        return _add(self, as_field(other), -1.0)

    def __rsub__(self, other: float) -> "Field":
        return _add(as_field(other), self, -1.0)

    def __mul__(self, other: "Field | float") -> "Field":
        if isinstance(self, Affine) and isinstance(other, (int, float)):
            return self.scaled(float(other))
        return Combine(Op.MULTIPLY, self, as_field(other))

    def __rmul__(self, other: float) -> "Field":
        return self * other

    def __neg__(self) -> "Field":
        if isinstance(self, Affine):
            return self.scaled(-1.0)
        return Unary(Op.NEGATE, self)

    def __abs__(self) -> "Field":
        return Unary(Op.ABSOLUTE, self)


@dataclass(frozen=True, slots=True)
class Affine(Field):
    """Return ``constant + u * gradient[0] + y * gradient[1] + z * gradient[2]``."""

    constant: float
    gradient: Point = (0.0, 0.0, 0.0)

    def evaluate(self, points: Array) -> Array:
        c, g = self.constant, self.gradient
        value: Array = c + g[0] * points[0] + g[1] * points[1] + g[2] * points[2]
        return value

    def encode(self, encoder: Encoder) -> None:
        encoder.emit(Op.AFFINE, [self.constant, *self.gradient])

    def scaled(self, factor: float) -> "Affine":
        """Multiply by a number."""
        u, y, z = self.gradient
        return Affine(factor * self.constant, (factor * u, factor * y, factor * z))


def _add(left: "Field", right: "Field", sign: float) -> "Field":
    """Add or subtract; two affine fields fold into one instruction."""
    if isinstance(left, Affine) and isinstance(right, Affine):
        a, b = left.gradient, right.gradient
        slope = (a[0] + sign * b[0], a[1] + sign * b[1], a[2] + sign * b[2])
        return Affine(left.constant + sign * right.constant, slope)
    return Combine(Op.ADD if sign > 0 else Op.SUBTRACT, left, right)


def as_field(value: Field | float) -> Field:
    """Turn a number into the field that has it everywhere."""
    return value if isinstance(value, Field) else Affine(float(value))


u = Affine(0.0, (1.0, 0.0, 0.0))
y = Affine(0.0, (0.0, 1.0, 0.0))
z = Affine(0.0, (0.0, 0.0, 1.0))


@dataclass(frozen=True, slots=True)
class Table(Field):
    """Interpolate along one axis: constant beyond the end knots, linear between.

    Corners are hyperbolas of half width `rounding` mm (0 keeps them sharp): each knot
    adds its change of slope times ``(t + sqrt(t^2 + rounding^2)) / 2``.
    """

    axis: int
    knots: tuple[float, ...]
    values: tuple[float, ...]
    rounding: float = 0.8

    def __post_init__(self) -> None:
        if len(self.knots) != len(self.values) or not all(
            a < b for a, b in zip(self.knots, self.knots[1:], strict=False)
        ):
            raise UserError(
                f"a table needs increasing knots with one value each, got knots "
                f"{self.knots} and values {self.values}"
            )

    def slope_changes(self) -> Array:
        """Return the change of slope at each knot."""
        slopes = np.diff(self.values) / np.diff(self.knots)
        return np.diff(np.concatenate([[0.0], slopes, [0.0]]))

    def evaluate(self, points: Array) -> Array:
        result: Array = np.full_like(points[0], self.values[0])
        for knot, change in zip(self.knots, self.slope_changes(), strict=True):
            t = points[self.axis] - knot
            result += change * 0.5 * (t + np.sqrt(t * t + self.rounding**2))
        return result

    def encode(self, encoder: Encoder) -> None:
        pairs = np.stack([self.knots, 0.5 * self.slope_changes()], axis=1)
        encoder.emit(
            Op.TABLE,
            [self.values[0], self.rounding**2, *pairs.ravel()],
            len(self.knots),
            self.axis,
        )


def depth_table(
    depths: Sequence[float], values: Sequence[float], rounding: float = 0.8
) -> Table:
    """Tabulate over the depth ``-y`` behind the anterior nasal spine."""
    knots = tuple(-d for d in reversed(depths))
    return Table(Y, knots, tuple(float(v) for v in reversed(values)), rounding)


def height_table(
    heights: Sequence[float], values: Sequence[float], rounding: float = 0.8
) -> Table:
    """Tabulate over the height z."""
    return Table(Z, tuple(heights), tuple(float(v) for v in values), rounding)


@dataclass(frozen=True, slots=True)
class Chain(Field):
    """Join round cones: one capsule between consecutive points, radius linear."""

    points: tuple[Point, ...]
    radii: tuple[float, ...]

    def evaluate(self, points: Array) -> Array:
        best: Array = np.full_like(points[0], np.inf)
        for i in range(len(self.points) - 1):
            a, b = np.array(self.points[i]), np.array(self.points[i + 1])
            along = (b - a) / ((b - a) @ (b - a))
            offset = points - a[:, None]
            t = np.clip(along @ offset, 0, 1)
            d = np.sqrt(np.sum((offset - t * (b - a)[:, None]) ** 2, axis=0))
            ra, rb = self.radii[i], self.radii[i + 1]
            best = np.minimum(best, d - (ra + (rb - ra) * t))
        return best

    def encode(self, encoder: Encoder) -> None:
        rows: list[float] = []
        for i in range(len(self.points) - 1):
            a, b = np.array(self.points[i]), np.array(self.points[i + 1])
            rows += [*a, *(b - a), 1.0 / float((b - a) @ (b - a))]
            rows += [self.radii[i], self.radii[i + 1] - self.radii[i]]
        encoder.emit(Op.CHAIN, rows, len(self.points) - 1)


@dataclass(frozen=True, slots=True)
class Ellipsoid(Field):
    """Approximate the distance to an ellipsoid by ``k0 (k0 - 1) / k1``.

    k0 is the norm of the point scaled by the radii, k1 the norm of its gradient times
    k0; exact to first order at the surface, and less the least radius at the centre,
    where the plain form is 0 / 0.
    """

    center: Point
    radii: Point

    def evaluate(self, points: Array) -> Array:
        r = np.array(self.radii)[:, None]
        p = (points - np.array(self.center)[:, None]) / r
        k0 = np.sqrt(np.sum(p * p, axis=0))
        k1 = np.sqrt(np.sum((p / r) ** 2, axis=0)) + 1e-6 / r.min()
        value: Array = (k0 + 1e-6) * (k0 - 1) / k1
        return value

    def encode(self, encoder: Encoder) -> None:
        encoder.emit(Op.ELLIPSOID, [*self.center, *(1.0 / r for r in self.radii)])


@dataclass(frozen=True, slots=True)
class FlatTube(Field):
    """Sweep an ellipse along y; centre and half widths are fields of y.

    Inside and near, ``(k - 1) * least half width`` never exceeds the distance.
    """

    center_u: Field
    center_z: Field
    half_u: Field
    half_z: Field

    def evaluate(self, points: Array) -> Array:
        a = np.maximum(self.half_u.evaluate(points), 0.05)
        b = np.maximum(self.half_z.evaluate(points), 0.05)
        du = (points[U] - self.center_u.evaluate(points)) / a
        dz = (points[Z] - self.center_z.evaluate(points)) / b
        value: Array = (np.sqrt(du * du + dz * dz) - 1) * np.minimum(a, b)
        return value

    def encode(self, encoder: Encoder) -> None:
        for part in (self.center_u, self.center_z, self.half_u, self.half_z):
            part.encode(encoder)
        encoder.emit(Op.FLAT_TUBE, [])


@dataclass(frozen=True, slots=True)
class Combine(Field):
    """Join two fields point by point; `width` blends a minimum or maximum."""

    op: Op
    left: Field
    right: Field
    width: float = 0.0

    def evaluate(self, points: Array) -> Array:
        a, b = self.left.evaluate(points), self.right.evaluate(points)
        if self.op == Op.ADD:
            return a + b
        if self.op == Op.SUBTRACT:
            return a - b
        if self.op == Op.MULTIPLY:
            return a * b
        sign = 1.0 if self.op == Op.SMOOTH_MIN else -1.0
        low = np.minimum(sign * a, sign * b)
        if self.width > 0:
            e = np.maximum(self.width - np.abs(a - b), 0)
            low = low - e * e * (0.25 / self.width)
        return sign * low

    def encode(self, encoder: Encoder) -> None:
        self.left.encode(encoder)
        self.right.encode(encoder)
        share = 0.25 / self.width if self.width > 0 else 0.0
        encoder.emit(self.op, [self.width, share])


@dataclass(frozen=True, slots=True)
class Unary(Field):
    """Change one field point by point."""

    op: Op
    inner: Field

    def evaluate(self, points: Array) -> Array:
        value = self.inner.evaluate(points)
        return np.abs(value) if self.op == Op.ABSOLUTE else -value

    def encode(self, encoder: Encoder) -> None:
        self.inner.encode(encoder)
        encoder.emit(self.op, [])


def smooth_min(width: float, *fields: Field | float) -> Field:
    """Unite fields from left to right, blending over `width` mm."""
    result = as_field(fields[0])
    for other in fields[1:]:
        result = Combine(Op.SMOOTH_MIN, result, as_field(other), width)
    return result


def smooth_max(width: float, *fields: Field | float) -> Field:
    """Intersect fields from left to right, blending over `width` mm."""
    result = as_field(fields[0])
    for other in fields[1:]:
        result = Combine(Op.SMOOTH_MAX, result, as_field(other), width)
    return result


@dataclass(frozen=True, slots=True)
class Cells(Field):
    """Divide space into cells of uneven size with walls of even thickness.

    A point belongs to the seed to whose sphere, of the seed's reach, it is nearest: the
    walls are hyperboloids about the smaller cell of two. The value is ``half wall -
    distance to the nearest wall's middle``, exact to first order at the wall; the
    distances to the owner's walls are blended over `width` mm, which rounds the cell.
    """

    seeds: tuple[Point, ...]
    reaches: tuple[float, ...]
    half_wall: float
    width: float

    def evaluate(self, points: Array) -> Array:
        offset = points[None] - np.array(self.seeds)[:, :, None]
        far = np.sqrt(np.sum(offset**2, axis=1))
        gap = far - np.array(self.reaches)[:, None]
        owner, column = np.argmin(gap, axis=0), np.arange(points.shape[1])
        away = offset / np.maximum(far, 1e-6)[:, None]
        wall = np.full_like(points[0], 1e3)
        for j in range(len(self.seeds)):
            along = np.sum(away[j] * away[owner, :, column].T, axis=0)
            chord = np.sqrt(np.maximum(2 - 2 * along, 0.25))
            d = (gap[j] - gap[owner, column]) / chord
            d = np.where(owner == j, np.inf, d)
            e = np.maximum(self.width - np.abs(wall - d), 0)
            wall = np.minimum(wall, d) - e * e * (0.25 / self.width)
        value: Array = self.half_wall - wall
        return value

    def encode(self, encoder: Encoder) -> None:
        flat = [
            value
            for seed, reach in zip(self.seeds, self.reaches, strict=True)
            for value in (*seed, reach)
        ]
        encoder.emit(
            Op.CELLS,
            [self.half_wall, self.width, 0.25 / self.width, *flat],
            len(self.seeds),
        )


@dataclass(frozen=True, slots=True)
class Unevenness(Field):
    """Push the block's row of solid noise, times `weight`.

    Row 0 is the waviness of all walls, row 1 the lymphoid tissue of the nasopharynx.
    It depends on the place in the head and not on the side, so the numpy meaning is
    zero: smooth walls.
    """

    row: int
    weight: float

    def evaluate(self, points: Array) -> Array:
        return np.zeros_like(points[0])

    def encode(self, encoder: Encoder) -> None:
        encoder.emit(Op.NOISE, [self.weight], 0, self.row)


@dataclass(frozen=True, slots=True)
class Mark(Field):
    """Pass a field on and keep the least value it takes in a row of marks.

    Marks tell how near a point is to a named structure; tint and labels use them.
    """

    row: int
    inner: Field

    def evaluate(self, points: Array) -> Array:
        return self.inner.evaluate(points)

    def encode(self, encoder: Encoder) -> None:
        self.inner.encode(encoder)
        encoder.emit(Op.MARK, [], 0, self.row)


@dataclass(frozen=True, slots=True)
class Recall(Field):
    """Push a mark that an earlier field left; `inner` is what it marked."""

    row: int
    inner: Field

    def evaluate(self, points: Array) -> Array:
        return self.inner.evaluate(points)

    def encode(self, encoder: Encoder) -> None:
        encoder.emit(Op.RECALL, [], 0, self.row)


def bare(field: Field) -> Field:
    """Strip a part's mark and unevenness, also under what bounds it."""
    if isinstance(field, Mark):
        return bare(field.inner)
    if isinstance(field, Combine) and isinstance(field.right, Unevenness):
        return field.left
    if isinstance(field, Combine) and field.op == Op.SMOOTH_MAX:
        return replace(field, left=bare(field.left))
    return field


@dataclass(frozen=True, slots=True)
class Warp(Field):
    """Evaluate a field at points moved by three fields; warps do not nest.

    The norm of the shifts' gradient adds to the field's steepness.
    """

    shift_u: Field
    shift_y: Field
    shift_z: Field
    inner: Field

    def evaluate(self, points: Array) -> Array:
        moved = points[:3] + [
            shift.evaluate(points)
            for shift in (self.shift_u, self.shift_y, self.shift_z)
        ]
        return self.inner.evaluate(moved)

    def encode(self, encoder: Encoder) -> None:
        for shift in (self.shift_u, self.shift_y, self.shift_z):
            shift.encode(encoder)
        encoder.emit(Op.WARP, [])
        self.inner.encode(encoder)
        encoder.emit(Op.UNWARP, [])


@dataclass(frozen=True, slots=True)
class Signed(Field):
    """Return the distance from the septum's plane, positive to the patient's right.

    In numpy it needs a fourth row of points; without one it is u, the right side.
    """

    def evaluate(self, points: Array) -> Array:
        value: Array = points[3] if len(points) > 3 else points[U]
        return value + 0.0

    def encode(self, encoder: Encoder) -> None:
        encoder.emit(Op.SIGNED, [])


def shifted(field: Field, du: Field | float, dz: Field | float) -> Field:
    """Move a field's content by ``(-du, 0, -dz)``."""
    return Warp(as_field(du), as_field(0.0), as_field(dz), field)


def extruded(
    line: tuple[tuple[float, float], ...],
    du: Field | float = 0.0,
    dz: Field | float = 0.0,
) -> Field:
    """Return the distance to a line of ``(u, z)`` points drawn out along y."""
    chain = Chain(tuple((a, 0.0, b) for a, b in line), (0.0,) * len(line))
    return Warp(as_field(du), -y, as_field(dz), chain)


def one_side(field: Field, sign: float) -> Field:
    """Keep a field on the right (+1) or the left (-1) only."""
    signed = Signed()
    return smooth_max(0.0, field, -signed if sign > 0 else signed)


def bump(
    knots_y: tuple[float, float, float], knots_z: tuple[float, float, float]
) -> Field:
    """Return a hill of height 1 over the (y, z) plane, 0 beyond the outer knots."""
    rounding = 0.2 * min(knots_y[1] - knots_y[0], knots_z[1] - knots_z[0])
    along = Table(1, knots_y, (0.0, 1.0, 0.0), rounding)
    return along * height_table(list(knots_z), [0.0, 1.0, 0.0], rounding)
