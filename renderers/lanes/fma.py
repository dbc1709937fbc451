"""A product added to a number: rounded once where the processor can, else twice.

Processors with AVX2 and those of 64-bit Arm round once, in the time of the product
alone; vectors do as numbers do. Where the bits must be those of any
processor, as in the ray tracer, products and sums stay two operations.
"""

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typing.templates import signature
from numba.extending import intrinsic

_NAMES = {types.float32: "llvm.fmuladd.f32", types.float64: "llvm.fmuladd.f64"}


def _muladd(typingctx: Any, x: Any, y: Any, z: Any) -> Any:
    """Give x * y + z of three numbers of one real type."""
    if x not in _NAMES or not x == y == z:
        return None

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        kind = ir.FunctionType(args[0].type, [a.type for a in args])
        call = cgutils.get_or_insert_function(builder.module, kind, _NAMES[x])
        return builder.call(call, args)

    return signature(x, x, x, x), generate


muladd: Any = intrinsic(_muladd)
