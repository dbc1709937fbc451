"""Vectors to and from interleaved memory.

Three floats a pixel (rays, normals, colours) are three vectors read one after the
other and sorted; two small numbers a voxel are read together. Loads and stores stay
with the caller, who knows which lanes are his (`load_triples` and `store_triples` are
for pixels without gaps). What only moves is not sorted.
"""

from collections.abc import Sequence
from typing import Any

from numba import types
from numba.core.typing.templates import signature

from renderers.simd.load_store import gather_lanes, stored
from renderers.simd.records import byte_offsets, is_rows, row_type
from renderers.simd.vector import (
    BYTE,
    Vector,
    ir,
    shuffle,
    vector_function,
    width_function,
)

_PAIR_STEP = ir.IntType(16)


def _take(builder: Any, parts: Sequence[Any], lanes: Sequence[int]) -> Any:
    """Take as many lanes as a vector has of three vectors, numbered through."""
    n = parts[0].type.count
    first = shuffle(builder, parts[0], parts[1], [k if k < 2 * n else 0 for k in lanes])
    last = [n + k - 2 * n if k >= 2 * n else i for i, k in enumerate(lanes)]
    return shuffle(builder, first, parts[2], last)


def _are_alike(*vectors: Any) -> bool:
    return all(isinstance(v, Vector) and v == vectors[0] for v in vectors)


@vector_function
def unzip3(a: Any, b: Any, c: Any) -> Any:
    """Sort three consecutive vectors of x, y, z, x, y, z ... into x, y and z."""
    if not _are_alike(a, b, c):
        return None

    def emit(builder: Any, *parts: Any) -> Any:
        lanes = range(3 * a.count)
        return [_take(builder, parts, lanes[k::3]) for k in range(3)]

    return signature(types.UniTuple(a, 3), a, b, c), emit


@vector_function
def zip3(x: Any, y: Any, z: Any) -> Any:
    """Return the three vectors that lie one after the other as x, y, z, x, y, z ..."""
    if not _are_alike(x, y, z):
        return None

    def emit(builder: Any, *parts: Any) -> Any:
        n = x.count
        order = [n * (k % 3) + k // 3 for k in range(3 * n)]
        return [_take(builder, parts, order[k * n : k * n + n]) for k in range(3)]

    return signature(types.UniTuple(x, 3), x, y, z), emit


@vector_function
def gather_pairs(pairs: Any, index: Any) -> Any:
    """Join two neighbouring 16-bit numbers at every i32 index, the first one low.

    All lanes are read. A little-endian machine is assumed.
    """
    found = stored(pairs)
    if found is None or found[1] != _PAIR_STEP:
        return None
    if not isinstance(index, Vector) or index.element != "i32":
        return None

    def emit(builder: Any, base: Any, at: Any) -> Any:
        every = ir.Constant(index.like("bool").llvm, [1] * index.count)
        return gather_lanes(builder, base, at, every, _PAIR_STEP, index)

    return signature(index, pairs, index), emit


@width_function
def rows_alike(x: Any, rows: Any) -> Any:
    """Repeat a whole vector, as the rows of a block."""
    if not isinstance(rows, types.IntegerLiteral) or not isinstance(x, Vector):
        return None
    times = rows.literal_value

    def emit(builder: Any, lanes: Any, rows: Any) -> Any:
        return shuffle(builder, lanes, lanes, list(range(x.count)) * times)

    return signature(Vector(x.element, x.count * times), x, rows), emit


@width_function
def swapped(x: Any, step: Any) -> Any:
    """Exchange every lane with the one `step`, a power of two, before or after it."""
    if not isinstance(step, types.IntegerLiteral) or not isinstance(x, Vector):
        return None
    places = [lane ^ step.literal_value for lane in range(x.count)]
    if max(places) >= x.count:
        return None

    def emit(builder: Any, lanes: Any, step: Any) -> Any:
        return shuffle(builder, lanes, lanes, places)

    return signature(x, x, step), emit


@vector_function
def copy_rows4(to: Any, places: Any, array: Any, index: Any) -> Any:
    """Copy rows of four from ``index`` of one array to ``places`` of another.

    As `rows4` and `put_rows4`, but nothing is turned into columns and back.
    """
    if not is_rows(to, places) or not is_rows(array, index) or places != index:
        return None
    if to.dtype != array.dtype:
        return None
    kind = row_type(array)

    def emit(builder: Any, there: Any, ends: Any, here: Any, starts: Any) -> None:
        ends, starts = byte_offsets(builder, ends, 4), byte_offsets(builder, starts, 4)
        for end, start in zip(ends, starts, strict=True):
            at = builder.gep(here, [start], source_etype=BYTE)
            row = builder.load(builder.bitcast(at, kind.as_pointer()))
            row.align = 4
            at = builder.gep(there, [end], source_etype=BYTE)
            builder.store(row, builder.bitcast(at, kind.as_pointer())).align = 4

    return signature(types.void, to, places, array, index), emit
