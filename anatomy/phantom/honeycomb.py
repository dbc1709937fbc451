"""Fields that need more than the point: ethmoid cells, unevenness, marks."""

from dataclasses import dataclass

import numpy as np

from anatomy.phantom.program import Encoder, Op
from anatomy.phantom.shapes import Array, Combine, Field, Point


@dataclass(frozen=True, slots=True)
class Cells(Field):
    """Divide a region into Voronoi cells with walls between them.

    Inside a cell, the value is the smooth maximum of the region and of ``half wall -
    distance to the nearest bisector``; the distances to the owner's bisectors are
    blended over `width` mm, which rounds the corners where three walls meet.
    """

    region: Field
    seeds: tuple[Point, ...]
    half_wall: float
    width: float

    def evaluate(self, points: Array) -> Array:
        seeds = np.array(self.seeds)
        offset = points[None] - seeds[:, :, None]
        square = np.sum(offset**2, axis=1)
        owner = np.argmin(square, axis=0)
        column = np.arange(points.shape[1])
        wall = np.full_like(points[0], 1e3)
        for j in range(len(seeds)):
            gap = np.linalg.norm(seeds[j] - seeds[owner], axis=1)
            with np.errstate(divide="ignore", invalid="ignore"):
                d = (square[j] - square[owner, column]) / (2 * gap)
            d = np.where(owner == j, np.inf, d)
            e = np.maximum(self.width - np.abs(wall - d), 0)
            wall = np.minimum(wall, d) - e * e * (0.25 / self.width)
        region, inner = self.region.evaluate(points), self.half_wall - wall
        e = np.maximum(self.width - np.abs(region - inner), 0)
        value: Array = np.maximum(region, inner) + e * e * (0.25 / self.width)
        return value

    def encode(self, encoder: Encoder) -> None:
        self.region.encode(encoder)
        flat = [c for seed in self.seeds for c in seed]
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
    """Strip a part's outer mark and unevenness: its plain shape."""
    if isinstance(field, Mark):
        return bare(field.inner)
    if isinstance(field, Combine) and isinstance(field.right, Unevenness):
        return field.left
    return field
