"""Python's operators on vectors; the other operand may be a number.

A number is converted to the vector's element first. Integers wrap, shift right is
arithmetic, comparisons give masks and follow IEEE 754: only ``!=`` holds for NaN.
Masks take ``& | ^ ~``; `and`, `or`, `not` and `if` do not work on them.
"""

import operator
from collections.abc import Callable
from typing import Any

from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import lower_builtin

from renderers.simd.vector import INTEGERS, NUMBERS, REALS, Vector, shared_vector

Emit = Callable[[Any, Vector, list[Any]], Any]


def _register(
    function: Any, arity: int, elements: tuple[str, ...], emit: Emit, to_mask: bool
) -> None:
    class Template(AbstractTemplate):
        def generic(self, args: Any, kws: Any) -> Any:
            vector = shared_vector(args)
            if len(args) != arity or vector is None or vector.element not in elements:
                return None
            result = vector.like("bool") if to_mask else vector
            return signature(result, *([vector] * arity))

    infer_global(function)(Template)

    @lower_builtin(function, *([Vector] * arity))
    def _lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return emit(builder, sig.args[0], list(args))


def _binary(name: str, elements: tuple[str, ...], emit: Emit) -> None:
    _register(getattr(operator, name), 2, elements, emit, to_mask=False)
    # numba looks x += y up under its own name and does not fall back to x + y
    in_place = getattr(operator, f"i{name.strip('_')}")
    _register(in_place, 2, elements, emit, to_mask=False)


def _instruction(real: str, integer: str) -> Emit:
    def emit(builder: Any, vector: Vector, args: list[Any]) -> Any:
        return getattr(builder, real if vector.is_real else integer)(*args)

    return emit


def _comparison(sign: str) -> Emit:
    def emit(builder: Any, vector: Vector, args: list[Any]) -> Any:
        if not vector.is_real:
            return builder.icmp_signed(sign, *args)
        if sign == "!=":
            return builder.fcmp_unordered(sign, *args)
        return builder.fcmp_ordered(sign, *args)

    return emit


_binary("add", NUMBERS, _instruction("fadd", "add"))
_binary("sub", NUMBERS, _instruction("fsub", "sub"))
_binary("mul", NUMBERS, _instruction("fmul", "mul"))
_binary("truediv", REALS, _instruction("fdiv", ""))
for _name in ("and_", "or_", "xor"):
    _binary(_name, (*INTEGERS, "bool"), _instruction("", _name))
_binary("lshift", INTEGERS, _instruction("", "shl"))
_binary("rshift", INTEGERS, _instruction("", "ashr"))
_register(operator.neg, 1, NUMBERS, _instruction("fneg", "neg"), to_mask=False)
_register(
    operator.invert, 1, (*INTEGERS, "bool"), _instruction("", "not_"), to_mask=False
)
for _name, _sign in (
    ("lt", "<"), ("le", "<="), ("gt", ">"), ("ge", ">="), ("eq", "=="), ("ne", "!=")
):  # fmt: skip
    _register(getattr(operator, _name), 2, NUMBERS, _comparison(_sign), to_mask=True)
