"""Records of four numbers, one per lane, to and from vectors.

Every lane reads a record (a colour, a ray, a corner of a cell) at a place of its own.
A 16-byte load per lane and a 4 x 4 transpose is 2.5 times as fast as four hardware
gathers (measured) and needs none. Part c of four holds the records of lanes
c, 4 + c, 8 + c ...: a transpose inside each group of four then puts every lane in
its place, for any width from four.
"""

from typing import Any

from numba import types
from numba.core.typing.templates import signature

from renderers.simd.load_store import stored
from renderers.simd.vector import (
    BYTE,
    ELEMENTS,
    I32,
    I64,
    Vector,
    concatenate,
    ir,
    shuffle,
    splat,
    vector_function,
    width_function,
)

_ROW = ir.VectorType(ELEMENTS["f32"], 4)
_INTEGER_ROW = ir.VectorType(ELEMENTS["i32"], 4)


def transpose(builder: Any, parts: list[Any]) -> list[Any]:
    """Transpose 4 x 4 numbers in each group of four lanes of four vectors."""
    n = parts[0].type.count
    low = [k for i in range(0, n, 4) for k in (i, n + i, i + 1, n + i + 1)]
    high = [k + 2 for k in low]
    first = [k for i in range(0, n, 4) for k in (i, i + 1, n + i, n + i + 1)]
    last = [k + 2 for k in first]
    a, b, c, d = parts
    ab_low, ab_high = shuffle(builder, a, b, low), shuffle(builder, a, b, high)
    cd_low, cd_high = shuffle(builder, c, d, low), shuffle(builder, c, d, high)
    return [
        shuffle(builder, ab_low, cd_low, first),
        shuffle(builder, ab_low, cd_low, last),
        shuffle(builder, ab_high, cd_high, first),
        shuffle(builder, ab_high, cd_high, last),
    ]


def spread_in_groups(builder: Any, x: Any, which: int) -> Any:
    """Repeat one lane of each group of four over the group."""
    lanes = [i + which for i in range(0, x.type.count, 4) for _ in range(4)]
    return shuffle(builder, x, x, lanes)


def byte_offsets(builder: Any, index: Any, shift: int) -> list[Any]:
    """Return every lane of an i32 index, shifted left, as a 64-bit scalar."""
    by = splat(builder, ir.Constant(I32, shift), index.type.count)
    moved = builder.shl(index, by)
    return [
        builder.zext(builder.extract_element(moved, ir.Constant(I32, k)), I64)
        for k in range(index.type.count)
    ]


def load_part(
    builder: Any, base: Any, offsets: list[Any], kind: Any, part: int, align: int
) -> Any:
    """Load one `kind` per lane of one part of four, joined."""
    loaded = []
    for k in range(part, len(offsets), 4):
        at = builder.gep(base, [offsets[k]], source_etype=BYTE)
        x = builder.load(builder.bitcast(at, kind.as_pointer()))
        x.align = align
        loaded.append(x)
    return concatenate(builder, loaded)


def is_rows(array: Any, index: Any) -> bool:
    """Return whether a lane can read or write a row of four of an array."""
    found = stored(array)
    return (
        found is not None
        and array.dtype in (types.float32, types.int32)
        and isinstance(index, Vector)
        and index.element == "i32"
        and index.count >= 4
    )


def row_type(array: Any) -> Any:
    """Return the LLVM type of a row of four."""
    return _INTEGER_ROW if array.dtype == types.int32 else _ROW


@vector_function
def rows4(array: Any, index: Any) -> Any:
    """Return the four columns of rows ``index`` of an array of rows of four.

    The array is float32 or int32. Indices are not negative, and rows end below 2 GiB.
    """
    if not is_rows(array, index):
        return None
    vector = index.like("f32" if array.dtype == types.float32 else "i32")
    kind = row_type(array)

    def emit(builder: Any, base: Any, index: Any) -> Any:
        offsets = byte_offsets(builder, index, 4)
        parts = [load_part(builder, base, offsets, kind, c, 4) for c in range(4)]
        return transpose(builder, parts)

    return signature(types.UniTuple(vector, 4), array, index), emit


@vector_function
def rows8(array: Any, index: Any) -> Any:
    """Return the eight columns of rows ``index`` of an array of rows of eight.

    As `rows4`; a lane's place is worked out once for both halves of its row.
    """
    if not is_rows(array, index):
        return None
    vector = index.like("f32" if array.dtype == types.float32 else "i32")
    kind = row_type(array)

    def emit(builder: Any, base: Any, index: Any) -> Any:
        second = builder.gep(base, [ir.Constant(I64, 16)], source_etype=BYTE)
        offsets = byte_offsets(builder, index, 5)
        columns = []
        for half in (base, second):
            parts = [load_part(builder, half, offsets, kind, c, 4) for c in range(4)]
            columns += transpose(builder, parts)
        return columns

    return signature(types.UniTuple(vector, 8), array, index), emit


@vector_function
def put_rows4(array: Any, index: Any, x: Any, y: Any, z: Any, w: Any) -> Any:
    """Store rows of four, the reverse of `rows4`; lanes in order.

    All lanes are stored: send unwanted ones to a spare row.
    """
    if not is_rows(array, index):
        return None
    element = "f32" if array.dtype == types.float32 else "i32"
    if any(column != index.like(element) for column in (x, y, z, w)):
        return None
    kind = row_type(array)

    def emit(builder: Any, base: Any, index: Any, *columns: Any) -> Any:
        offsets = byte_offsets(builder, index, 4)
        parts = transpose(builder, list(columns))
        for k in range(index.type.count):
            first = k // 4 * 4
            part = parts[k % 4]
            row = shuffle(builder, part, part, range(first, first + 4))
            at = builder.gep(base, [offsets[k]], source_etype=BYTE)
            at = builder.bitcast(at, kind.as_pointer())
            builder.store(row, at).align = 4

    return signature(types.void, array, index, x, y, z, w), emit


@width_function
def row(x: Any, y: Any, z: Any, w: Any, width: Any) -> Any:
    """Repeat four float32 scalars: (x, y, z, w, x, y, z, w, ...)."""
    if not isinstance(width, types.IntegerLiteral):
        return None
    vector = Vector("f32", width.literal_value)

    def emit(builder: Any, *numbers: Any) -> Any:
        one = ir.Constant(_ROW, ir.Undefined)
        for k in range(4):
            one = builder.insert_element(one, numbers[k], ir.Constant(I32, k))
        return shuffle(builder, one, one, [k % 4 for k in range(vector.count)])

    return signature(vector, *([types.float32] * 4), width), emit


@vector_function
def store_spread(array: Any, index: Any, x: Any) -> Any:
    """Store every lane four times in a row, from the index-th float32 on."""
    found = stored(array)
    if found is None or array.dtype != types.float32:
        return None
    if not isinstance(x, Vector) or x.element != "f32":
        return None

    def emit(builder: Any, base: Any, index: Any, x: Any) -> Any:
        n = x.type.count
        for c in range(4):
            lanes = [(c * n + k) // 4 for k in range(n)]
            spread = shuffle(builder, x, x, lanes)
            place = builder.add(index, ir.Constant(I64, c * n))
            at = builder.gep(base, [place], source_etype=ELEMENTS["f32"])
            at = builder.bitcast(at, spread.type.as_pointer())
            builder.store(spread, at).align = 4

    return signature(types.void, array, types.intp, x), emit


def _is_groups(array: Any, *vectors: Any) -> bool:
    found = stored(array)
    return (
        found is not None
        and array.dtype in (types.float32, types.int32)
        and all(isinstance(v, Vector) and v.element == found[0] for v in vectors)
        and all(v == vectors[0] and v.count % 4 == 0 for v in vectors)
    )


@vector_function
def store_groups(array: Any, index: Any, step: Any, x: Any) -> Any:
    """Store every group of four lanes as a run, `step` elements apart.

    Sixteen lanes are a square of 4 x 4 pixels where `step` is a row of the picture.
    """
    if not _is_groups(array, x):
        return None

    def emit(builder: Any, base: Any, place: Any, step: Any, x: Any) -> Any:
        kind = row_type(array)
        for first in range(0, x.type.count, 4):
            run = shuffle(builder, x, x, range(first, first + 4))
            at = builder.gep(base, [place], source_etype=kind.element)
            builder.store(run, builder.bitcast(at, kind.as_pointer())).align = 4
            place = builder.add(place, step)

    return signature(types.void, array, types.intp, types.intp, x), emit


def _store_interleaved(
    builder: Any, base: Any, place: Any, step: Any, *rest: Any
) -> None:
    """Store every group of four lanes of some vectors as a run of tuples."""
    n = rest[0].type.count
    none = ir.Constant(rest[0].type, ir.Undefined)
    front = concatenate(builder, rest[:2])
    back = concatenate(builder, [rest[2], rest[3] if len(rest) > 3 else none])
    element = rest[0].type.element
    run = ir.VectorType(element, 4 * len(rest))
    for first in range(0, n, 4):
        lanes = [
            channel * n + lane
            for lane in range(first, first + 4)
            for channel in range(len(rest))
        ]
        tuples = shuffle(builder, front, back, lanes)
        at = builder.gep(base, [place], source_etype=element)
        builder.store(tuples, builder.bitcast(at, run.as_pointer())).align = 4
        place = builder.add(place, step)


@vector_function
def store_triples(array: Any, index: Any, step: Any, x: Any, y: Any, z: Any) -> Any:
    """Store (x, y, z, x, y, z ...) of every group of four lanes, `step` apart.

    As `store_groups` for pictures of three channels.
    """
    if not _is_groups(array, x, y, z):
        return None
    sig = signature(types.void, array, types.intp, types.intp, x, x, x)
    return sig, _store_interleaved


@vector_function
def store_quads(
    array: Any, index: Any, step: Any, x: Any, y: Any, z: Any, w: Any
) -> Any:
    """Store (x, y, z, w, x ...) of every group of four lanes, `step` apart."""
    if not _is_groups(array, x, y, z, w):
        return None
    sig = signature(types.void, array, types.intp, types.intp, x, x, x, x)
    return sig, _store_interleaved


@width_function
def load_triples(array: Any, index: Any, width: Any) -> Any:
    """Load `width` neighbouring (x, y, z) from the index-th float32 on, as columns."""
    if not _is_groups(array) or array.dtype != types.float32:
        return None
    if not isinstance(width, types.IntegerLiteral):
        return None
    vector = Vector("f32", width.literal_value)
    run = ir.VectorType(ELEMENTS["f32"], 3 * vector.count)

    def emit(builder: Any, base: Any, index: Any, width: Any) -> Any:
        at = builder.gep(base, [index], source_etype=ELEMENTS["f32"])
        triples = builder.load(builder.bitcast(at, run.as_pointer()))
        triples.align = 4
        return [
            shuffle(builder, triples, triples, range(c, 3 * vector.count, 3))
            for c in range(3)
        ]

    sig = signature(types.UniTuple(vector, 3), array, types.intp, width)
    return sig, emit
