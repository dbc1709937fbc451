"""Shapes that are alike in every patient, as ``shapes.toml`` has them."""

import msgspec

from anatomy.phantom.shapes import Chain, Ellipsoid, Field, Point, smooth_min
from anatomy.table_file import read_table

Rows = tuple[tuple[float, ...], ...]
"""Places of a chain with their radii, or an ellipsoid's middle and half axes."""


class _Union(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    width: float
    parts: tuple[Rows, ...]


class _Polyps(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    grades: tuple[int, ...]
    parts: tuple[Rows, ...]


class _Table(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Hold ``shapes.toml``."""

    shapes: dict[str, Rows]
    unions: dict[str, _Union]
    polyps: _Polyps


def built(rows: Rows) -> Chain | Ellipsoid:
    """Build a chain, or an ellipsoid; ValueError for rows of neither."""
    places: list[Point] = [(row[0], row[1], row[2]) for row in rows]
    lengths = [len(row) for row in rows]
    if lengths == [3, 3]:
        return Ellipsoid(*places)
    if len(rows) < 2 or {*lengths} != {4}:
        raise ValueError(f"neither a chain nor an ellipsoid: {rows}")
    return Chain(tuple(places), tuple(row[3] for row in rows))


_TABLE = read_table(__file__, "shapes.toml", _Table)

SHAPES: dict[str, Field] = {name: built(rows) for name, rows in _TABLE.shapes.items()}
SHAPES |= {
    name: smooth_min(union.width, *map(built, union.parts))
    for name, union in _TABLE.unions.items()
}

POLYPS = tuple(zip(_TABLE.polyps.grades, map(built, _TABLE.polyps.parts), strict=True))
"""In the order in which a polyposis grows: the grade from which each is there."""


def course(name: str) -> Chain:
    """Return one of `SHAPES` that is a chain; TypeError for another."""
    found = SHAPES[name]
    if not isinstance(found, Chain):
        raise TypeError(f"{name} is no chain")
    return found


def middle_of(name: str) -> Point:
    """Return the middle of an ellipsoid of `SHAPES`, or the first place of a chain."""
    found = SHAPES[name]
    return found.center if isinstance(found, Ellipsoid) else course(name).points[0]
