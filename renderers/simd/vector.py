"""The numba type of a vector, and the few pieces of LLVM that all its functions need.

The data model of `Vector` is an LLVM vector, so a variable of a kernel is a register
(or several, or a part of one, as the processor has them). Nothing here names a
processor: any width compiles anywhere and gives the same bits, because no operation
is contracted or reassociated.
"""

import inspect
from collections.abc import Callable, Iterable, Sequence
from functools import update_wrapper
from typing import Any

from llvmlite import ir as ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic, lower_cast, models, register_model

Function = Callable[..., Any]

ELEMENTS = {
    "f32": ir.FloatType(),
    "f64": ir.DoubleType(),
    "i32": ir.IntType(32),
    "i64": ir.IntType(64),
    "bool": ir.IntType(1),
}
I32, I64 = ELEMENTS["i32"], ELEMENTS["i64"]
BYTE = ir.IntType(8)

SCALARS = {
    "f32": types.float32,
    "f64": types.float64,
    "i32": types.int32,
    "i64": types.int64,
    "bool": types.boolean,
}
REALS = ("f32", "f64")
INTEGERS = ("i32", "i64")
NUMBERS = REALS + INTEGERS


class Vector(types.Type):
    """`count` lanes of one element; equal element and count are equal types."""

    def __init__(self, element: str, count: int) -> None:
        self.element, self.count = element, count
        super().__init__(f"vector<{element} x {count}>")

    def like(self, element: str) -> "Vector":
        """Return the type of as many lanes of another element."""
        return Vector(element, self.count)

    @property
    def llvm(self) -> Any:
        """Return the LLVM type."""
        return ir.VectorType(ELEMENTS[self.element], self.count)

    @property
    def is_real(self) -> bool:
        """Return whether lanes are floating-point."""
        return self.element in REALS


@register_model(Vector)
class _VectorModel(models.PrimitiveModel):
    def __init__(self, manager: Any, vector: Vector) -> None:
        super().__init__(manager, vector, vector.llvm)


def shared_vector(args: Iterable[Any]) -> Vector | None:
    """Find the one vector type among arguments that are it or numbers, or None."""
    args = tuple(args)
    vectors = [a for a in args if isinstance(a, Vector)]
    if not vectors or any(v != vectors[0] for v in vectors):
        return None
    number: Any = types.Number if vectors[0].is_real else types.Integer
    if all(isinstance(a, Vector | number) for a in args):
        return vectors[0]
    return None


def _typed(typer: Function) -> Function:
    """Make what numba asks of one that takes types and gives a signature and code.

    The code takes the builder and the arguments, arrays as pointers without a type; it
    gives a value, a list of those of a tuple, or None.
    """

    def typed(typingctx: Any, *kinds: Any) -> Any:
        found = typer(*kinds)
        if found is None:
            return None
        emit = found[1]

        def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            values = [
                data(context, builder, kind, value)
                if isinstance(kind, types.Array)
                else value
                for kind, value in zip(sig.args, args, strict=True)
            ]
            result = emit(builder, *values)
            if result is None:
                return context.get_dummy_value()
            if isinstance(result, list):
                return context.make_tuple(builder, sig.return_type, result)
            return result

        return found[0], generate

    own = inspect.signature(typer)
    context = inspect.Parameter("typingctx", inspect.Parameter.POSITIONAL_OR_KEYWORD)
    named: Any = update_wrapper(typed, typer)
    # numba counts a function's parameters by their names
    named.__signature__ = own.replace(parameters=[context, *own.parameters.values()])
    return typed


def vector_function(typer: Function) -> Function:
    """Make a function of compiled code out of one that types and generates it."""
    made: Function = intrinsic(_typed(typer))
    return made


def width_function(typer: Function) -> Function:
    """Make a function that is told the values of constants, such as widths."""
    made: Function = intrinsic(prefer_literal=True)(_typed(typer))
    return made


def data(context: Any, builder: Any, kind: Any, array: Any) -> Any:
    """Return an array's memory as a pointer without a type."""
    pointer = cgutils.create_struct_proxy(kind)(context, builder, array).data
    return builder.bitcast(pointer, ir.PointerType())


def constant_lanes(numbers: Iterable[int]) -> Any:
    """Return a constant vector of 32-bit integers."""
    values = [ir.Constant(I32, n) for n in numbers]
    return ir.Constant(ir.VectorType(I32, len(values)), values)


def shuffle(builder: Any, x: Any, y: Any, lanes: Iterable[int]) -> Any:
    """Take lanes of two equal vectors, numbered through."""
    return builder.shuffle_vector(x, y, constant_lanes(lanes))


def splat(builder: Any, x: Any, count: int) -> Any:
    """Copy a scalar into all lanes."""
    none = ir.Constant(ir.VectorType(x.type, count), ir.Undefined)
    first = builder.insert_element(none, x, ir.Constant(I32, 0))
    return shuffle(builder, first, none, [0] * count)


def concatenate(builder: Any, parts: Sequence[Any]) -> Any:
    """Join a power of two of equal vectors."""
    while len(parts) > 1:
        both = range(2 * parts[0].type.count)
        parts = [
            shuffle(builder, parts[i], parts[i + 1], both)
            for i in range(0, len(parts), 2)
        ]
    return parts[0]


def call_llvm(builder: Any, name: str, result: Any, args: Sequence[Any]) -> Any:
    """Call an LLVM intrinsic function by its full name."""
    kind = ir.FunctionType(result, [a.type for a in args])
    return builder.call(
        cgutils.get_or_insert_function(builder.module, kind, name), args
    )


def mangled(vector: Any) -> str:
    """Return an LLVM vector type's name inside names of intrinsic functions."""
    element = vector.element
    if element == ELEMENTS["f32"]:
        return f"v{vector.count}f32"
    if element == ELEMENTS["f64"]:
        return f"v{vector.count}f64"
    return f"v{vector.count}i{element.width}"


@lower_cast(types.Float, Vector)
@lower_cast(types.Integer, Vector)
def _cast_scalar(context: Any, builder: Any, frm: Any, to: Vector, value: Any) -> Any:
    scalar = types.unliteral(frm)
    lane = context.cast(builder, value, scalar, SCALARS[to.element])
    return splat(builder, lane, to.count)
