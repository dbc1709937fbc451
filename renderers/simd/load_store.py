"""Vectors to and from arrays: in a run, or lane by lane.

An index counts elements of a C-ordered array's memory, whatever its dimensions; none
is checked. Arrays of small integers hold `i32` lanes: they are widened when loaded
and cut off when stored.
"""

from typing import Any

from numba import types
from numba.core.typing.templates import signature

from renderers.simd.vector import (
    BYTE,
    ELEMENTS,
    I32,
    I64,
    Vector,
    call_llvm,
    ir,
    mangled,
    splat,
    vector_function,
    width_function,
)

# Element in lanes, bits in memory, how to widen.
_STORED: dict[Any, tuple[str, int, str]] = {
    types.float32: ("f32", 32, ""),
    types.float64: ("f64", 64, ""),
    types.int32: ("i32", 32, ""),
    types.int64: ("i64", 64, ""),
    types.uint8: ("i32", 8, "zext"),
    types.int16: ("i32", 16, "sext"),
    types.uint16: ("i32", 16, "zext"),
}


def stored(array: Any) -> tuple[str, Any, str] | None:
    """Tell an array's lane element, the LLVM type in memory, and how to widen it."""
    if not isinstance(array, types.Array) or array.layout != "C":
        return None
    found = _STORED.get(array.dtype)
    if found is None:
        return None
    element, size, widen = found
    return element, ir.IntType(size) if widen else ELEMENTS[element], widen


def _place(builder: Any, base: Any, index: Any, element: Any, count: int) -> Any:
    at = builder.gep(base, [index], source_etype=element)
    return builder.bitcast(at, ir.VectorType(element, count).as_pointer())


def bytes_of(element: Any) -> int:
    """Return the bytes of an element of LLVM's."""
    widths = {ELEMENTS["f32"]: 4, ELEMENTS["f64"]: 8}
    return widths.get(element) or element.width // 8


@width_function
def load(array: Any, index: Any, width: Any) -> Any:
    """Load `width` elements from the index-th on."""
    found = stored(array)
    if found is None or not isinstance(width, types.IntegerLiteral):
        return None
    element, memory, widen = found
    vector = Vector(element, width.literal_value)

    def emit(builder: Any, base: Any, index: Any, width: Any) -> Any:
        at = _place(builder, base, index, memory, vector.count)
        x = builder.load(at)
        x.align = bytes_of(memory)
        return getattr(builder, widen)(x, vector.llvm) if widen else x

    return signature(vector, array, types.intp, width), emit


@width_function
def spread(array: Any, index: Any, width: Any) -> Any:
    """Copy the index-th element into `width` lanes.

    As a number in a sum, but that no index counts from the end: to ask for that takes
    three instructions an element.
    """
    found = stored(array)
    if found is None or found[2] or not isinstance(width, types.IntegerLiteral):
        return None
    vector = Vector(found[0], width.literal_value)

    def emit(builder: Any, base: Any, index: Any, width: Any) -> Any:
        at = _place(builder, base, index, found[1], 1)
        at = builder.bitcast(at, found[1].as_pointer())
        return splat(builder, builder.load(at), vector.count)

    return signature(vector, array, types.intp, width), emit


@vector_function
def store(array: Any, index: Any, x: Any) -> Any:
    """Store all lanes from the index-th element on."""
    found = stored(array)
    if found is None or not isinstance(x, Vector) or x.element != found[0]:
        return None
    _, memory, widen = found

    def emit(builder: Any, base: Any, index: Any, lanes: Any) -> Any:
        at = _place(builder, base, index, memory, x.count)
        if widen:
            lanes = builder.trunc(lanes, ir.VectorType(memory, x.count))
        builder.store(lanes, at).align = bytes_of(memory)

    return signature(types.void, array, types.intp, x), emit


def is_plain(array: Any, element: str) -> bool:
    """Return whether an array holds lanes of this element as they are."""
    found = stored(array)
    return found is not None and found[0] == element and not found[2]


@vector_function
def load_where(array: Any, index: Any, mask: Any) -> Any:
    """Load a run of as many elements as the mask has lanes; zero where it is unset.

    Only memory of set lanes is touched. Elements of 4 or 8 bytes.
    """
    found = stored(array)
    is_mask = isinstance(mask, Vector) and mask.element == "bool"
    if found is None or found[2] or not is_mask:
        return None
    vector = mask.like(found[0])

    def emit(builder: Any, base: Any, index: Any, mask: Any) -> Any:
        kind = vector.llvm
        at = builder.gep(base, [index], source_etype=kind.element)
        at = builder.bitcast(at, ir.PointerType())
        align = ir.Constant(I32, bytes_of(kind.element))
        rest = [at, align, mask, ir.Constant(kind, None)]
        return call_llvm(builder, f"llvm.masked.load.{mangled(kind)}.p0", kind, rest)

    return signature(vector, array, types.intp, mask), emit


@vector_function
def store_where(array: Any, index: Any, x: Any, mask: Any) -> Any:
    """Store the lanes whose mask is set, in their places of a run.

    Only memory of set lanes is touched. Elements of 4 or 8 bytes.
    """
    if not isinstance(x, Vector) or mask != x.like("bool"):
        return None
    if not is_plain(array, x.element):
        return None

    def emit(builder: Any, base: Any, index: Any, lanes: Any, mask: Any) -> Any:
        kind = x.llvm
        at = builder.gep(base, [index], source_etype=kind.element)
        at = builder.bitcast(at, ir.PointerType())
        align = ir.Constant(I32, bytes_of(kind.element))
        call_llvm(
            builder,
            f"llvm.masked.store.{mangled(kind)}.p0",
            ir.VoidType(),
            [lanes, at, align, mask],
        )

    return signature(types.void, array, types.intp, x, mask), emit


@vector_function
def prefetch(array: Any, index: Any) -> Any:
    """Ask for the cache line of the index-th element; wherever it is, no fault."""
    found = stored(array)
    if found is None or not isinstance(types.unliteral(index), types.Integer):
        return None
    step = found[1]

    def emit(builder: Any, base: Any, index: Any) -> Any:
        at = builder.gep(base, [index], source_etype=step)
        # one kind of pointer for all arrays: the function is declared once
        at = builder.bitcast(at, BYTE.as_pointer())
        # to read, soon and more than once, data
        how = [ir.Constant(I32, n) for n in (0, 3, 1)]
        call_llvm(builder, "llvm.prefetch.p0", ir.VoidType(), [at, *how])

    return signature(types.void, array, types.intp), emit


def gather_lanes(
    builder: Any, base: Any, index: Any, mask: Any, step: Any, vector: Vector
) -> Any:
    """Take a lane at every index, counted in steps of an LLVM type, where allowed."""
    kind, count = vector.llvm, vector.count
    at = builder.gep(base, [index], source_etype=step)
    # llvmlite gives a vector of addresses the type of one
    at.type = ir.VectorType(ir.PointerType(), count)
    align = ir.Constant(I32, bytes_of(step))
    return call_llvm(
        builder,
        f"llvm.masked.gather.{mangled(kind)}.v{count}p0",
        kind,
        [at, align, mask, ir.Constant(kind, None)],
    )


@vector_function
def gather(array: Any, index: Any, mask: Any) -> Any:
    """Take ``array[index]`` lane by lane, zero where the mask is unset.

    Elements of 4 or 8 bytes; memory of unset lanes is not touched.
    """
    found = stored(array)
    if found is None or found[2] or not _is_index(index, mask):
        return None
    vector = index.like(found[0])

    def emit(builder: Any, base: Any, index: Any, mask: Any) -> Any:
        step = ELEMENTS[vector.element]
        return gather_lanes(builder, base, index, mask, step, vector)

    return signature(vector, array, index, mask), emit


@vector_function
def gather_u8(array: Any, index: Any, mask: Any) -> Any:
    """Take bytes ``array[index]`` as i32 lanes, zero where the mask is unset.

    Byte by byte: processors gather no bytes, and a gather of the words around them
    takes 1.1 to 1.5 times as long (AMD Zen 4). Unset lanes read byte 0.
    """
    found = stored(array)
    if found is None or array.dtype != types.uint8 or not _is_index(index, mask):
        return None
    vector = index.like("i32")

    def emit(builder: Any, base: Any, index: Any, mask: Any) -> Any:
        kind = ir.VectorType(BYTE, vector.count)
        at = builder.select(mask, index, ir.Constant(index.type, None))
        lanes = ir.Constant(kind, ir.Undefined)
        for k in range(vector.count):
            lane = ir.Constant(I32, k)
            place = builder.zext(builder.extract_element(at, lane), I64)
            place = builder.gep(base, [place], source_etype=BYTE)
            byte = builder.load(builder.bitcast(place, BYTE.as_pointer()))
            byte.align = 1
            lanes = builder.insert_element(lanes, byte, lane)
        wide = builder.zext(lanes, vector.llvm)
        return builder.select(mask, wide, ir.Constant(vector.llvm, None))

    return signature(vector, array, index, mask), emit


def _is_index(index: Any, mask: Any) -> bool:
    if not isinstance(index, Vector) or index.element not in ("i32", "i64"):
        return False
    return bool(mask == index.like("bool"))
