"""Fields of bent space: shapes along curves, sheets, and one side of the head."""

from dataclasses import dataclass

from anatomy.phantom.program import Encoder, Op
from anatomy.phantom.shapes import (
    Array,
    Chain,
    Field,
    Table,
    U,
    as_field,
    height_table,
    smooth_max,
    y,
)


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
