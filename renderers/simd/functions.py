"""Functions of vectors: lane by lane, conversions, and across lanes.

Widths are whole numbers known when a kernel is compiled: literals or constants of the
module. Only what makes a vector out of nothing names one. Importing this gives vectors
their operators as well.
"""

import inspect
from collections.abc import Callable
from functools import partial
from typing import Any

from numba import types
from numba.core.typing.templates import signature

import renderers.simd.operators  # noqa: F401
from renderers.simd.vector import (
    ELEMENTS,
    I32,
    I64,
    NUMBERS,
    REALS,
    SCALARS,
    Function,
    Vector,
    call_llvm,
    constant_lanes,
    ir,
    mangled,
    shared_vector,
    shuffle,
    splat,
    vector_function,
    width_function,
)

Emit = Callable[..., Any]


def _same(vector: Vector) -> Any:
    return vector


def _function(
    name: str,
    arity: int,
    emit: Emit,
    elements: tuple[str, ...] = NUMBERS,
    result: Callable[[Vector], Any] = _same,
) -> Function:
    """Make a function of `arity` vectors of one type, or numbers in their place."""

    def typed(*args: Any) -> Any:
        vector = shared_vector(args)
        if vector is None or vector.element not in elements:
            return None
        code = partial(emit, vector)
        return signature(result(vector), *([vector] * arity)), code

    typed.__name__ = name
    names = [
        inspect.Parameter(k, inspect.Parameter.POSITIONAL_OR_KEYWORD) for k in "xyz"
    ]
    vars(typed)["__signature__"] = inspect.Signature(names[:arity])
    return vector_function(typed)


def _llvm(stem: str) -> Emit:
    def emit(vector: Vector, builder: Any, *args: Any) -> Any:
        kind = vector.llvm
        return call_llvm(builder, f"llvm.{stem}.{mangled(kind)}", kind, args)

    return emit


def _pick(sign: str) -> Emit:
    def emit(vector: Vector, builder: Any, x: Any, y: Any) -> Any:
        compare = builder.fcmp_ordered if vector.is_real else builder.icmp_signed
        return builder.select(compare(sign, x, y), x, y)

    return emit


def _reduce(stem: str) -> Emit:
    def emit(vector: Vector, builder: Any, x: Any) -> Any:
        name = f"llvm.vector.reduce.{stem}.{mangled(vector.llvm)}"
        return call_llvm(builder, name, ELEMENTS["bool"], [x])

    return emit


def _halve(sign: str) -> Emit:
    """Compare the halves of a vector with each other until one lane is left."""
    pick = _pick(sign)

    def emit(vector: Vector, builder: Any, x: Any) -> Any:
        while (half := x.type.count // 2) > 0:
            low = shuffle(builder, x, x, range(half))
            high = shuffle(builder, x, x, range(half, 2 * half))
            x = pick(vector, builder, low, high)
        return builder.extract_element(x, ir.Constant(I32, 0))

    return emit


def _bits(vector: Vector, builder: Any, x: Any) -> Any:
    number = builder.bitcast(x, ir.IntType(vector.count))
    return number if vector.count == 64 else builder.zext(number, I64)


def _count(vector: Vector, builder: Any, x: Any) -> Any:
    return call_llvm(builder, "llvm.ctpop.i64", I64, [_bits(vector, builder, x)])


def _convert(vector: Vector, builder: Any, x: Any, to: Vector) -> Any:
    before, after = vector.element, to.element
    step = {
        "f32 f64": "fpext",
        "f64 f32": "fptrunc",
        "i32 i64": "sext",
        "i64 i32": "trunc",
    }.get(f"{before} {after}")
    if before == after:
        return x
    if step is None and before == "bool":
        step = "uitofp" if to.is_real else "zext"
    if step is None:
        step = "fptosi" if vector.is_real else "sitofp"
    return getattr(builder, step)(x, to.llvm)


def _conversion(name: str) -> Function:
    return _function(
        name,
        1,
        lambda vector, builder, x: _convert(vector, builder, x, vector.like(name)),
        (*NUMBERS, "bool"),
        lambda vector: vector.like(name),
    )


def _reading(name: str, element: str, of: str) -> Function:
    return _function(
        name,
        1,
        lambda vector, builder, x: builder.bitcast(x, vector.like(element).llvm),
        (of,),
        lambda vector: vector.like(element),
    )


sqrt = _function("sqrt", 1, _llvm("sqrt"), REALS)
absolute = _function("absolute", 1, _llvm("fabs"), REALS)
floor = _function("floor", 1, _llvm("floor"), REALS)
rint = _function("rint", 1, _llvm("rint"), REALS)
# x y + z, rounded once where the processor can (AVX2, 64-bit Arm), else twice. Where
# the bits must be those of any processor, products and sums stay two operations.
fma = _function("fma", 3, _llvm("fmuladd"), REALS)
# The second operand where one is NaN, as x86 has it.
minimum = _function("minimum", 2, _pick("<"))
maximum = _function("maximum", 2, _pick(">"))
least = _function("least", 1, _halve("<"), NUMBERS, lambda v: SCALARS[v.element])
greatest = _function("greatest", 1, _halve(">"), NUMBERS, lambda v: SCALARS[v.element])
any_ = _function("any_", 1, _reduce("or"), ("bool",), lambda _: types.boolean)
all_ = _function("all_", 1, _reduce("and"), ("bool",), lambda _: types.boolean)
bits = _function("bits", 1, _bits, ("bool",), lambda _: types.int64)
count = _function("count", 1, _count, ("bool",), lambda _: types.int64)

# Conversions. From real to integer they truncate, and a lane out of range is undefined.
f32, f64, i32, i64 = (_conversion(name) for name in NUMBERS)
as_f32 = _reading("as_f32", "f32", "i32")
as_i32 = _reading("as_i32", "i32", "f32")


@vector_function
def select(mask: Any, x: Any, y: Any) -> Any:
    """Take x where the mask is set, else y; one of them may be a number."""
    vector = shared_vector((x, y))
    if vector is None:
        # masks themselves, with no number in the place of one
        vector = x if isinstance(x, Vector) and x == y else None
    if vector is None or mask != vector.like("bool"):
        return None
    return signature(vector, mask, vector, vector), ir.IRBuilder.select


@width_function
def full(x: Any, width: Any) -> Any:
    """Return `width` copies of a scalar; its type is the element."""
    scalar = types.unliteral(x)
    element = next((name for name, kind in SCALARS.items() if kind == scalar), None)
    if element is None or not isinstance(width, types.IntegerLiteral):
        return None
    vector = Vector(element, width.literal_value)

    def emit(builder: Any, number: Any, width: Any) -> Any:
        return splat(builder, number, vector.count)

    return signature(vector, scalar, width), emit


@width_function
def lanes(width: Any) -> Any:
    """Return 0, 1, 2 ... width - 1 as 32-bit integers."""
    if not isinstance(width, types.IntegerLiteral):
        return None
    numbers = range(width.literal_value)

    def emit(builder: Any, width: Any) -> Any:
        return constant_lanes(numbers)

    return signature(Vector("i32", len(numbers)), width), emit


@vector_function
def lowest(x: Any) -> Any:
    """Return the number of the lowest bit that is set in an int64, 64 if none is."""
    if types.unliteral(x) != types.int64:
        return None

    def emit(builder: Any, number: Any) -> Any:
        whole = ir.Constant(ELEMENTS["bool"], 0)
        return call_llvm(builder, "llvm.cttz.i64", I64, [number, whole])

    return signature(types.int64, types.int64), emit


@vector_function
def rank(mask: Any) -> Any:
    """Count, for every lane, how many lanes before it are set."""
    if not isinstance(mask, Vector) or mask.element != "bool":
        return None
    result = mask.like("i32")

    def emit(builder: Any, set_lanes: Any) -> Any:
        n = result.count
        zero = ir.Constant(result.llvm, None)
        one = builder.zext(set_lanes, result.llvm)
        total, step = one, 1
        while step < n:
            # lane i of the shifted sums is lane i - step, or zero before the first
            moved = [n + i - step if i >= step else 0 for i in range(n)]
            total = builder.add(total, shuffle(builder, zero, total, moved))
            step *= 2
        return builder.sub(total, one)

    return signature(result, mask), emit
