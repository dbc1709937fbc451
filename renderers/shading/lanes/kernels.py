"""Compiled: vectors to and from interleaved memory, and elementary functions of them.

Three floats a pixel (rays, normals, colours) are three vectors read one after the
other and sorted; two bytes a voxel are read two voxels at a time.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from llvmlite import ir  # type: ignore[import-untyped]
from numba import njit
from numba import types as numba_types
from numba.core import cgutils as numba_cgutils
from numba.extending import intrinsic

from renderers.simd import Vector, as_f32, maximum, minimum
from renderers.simd import f32 as to_real
from renderers.simd import i32 as to_whole

types: Any = numba_types
cgutils: Any = numba_cgutils
Lanes = Any
"""A vector; it lives inside kernels only."""
Three = tuple[Lanes, Lanes, Lanes]
Four = tuple[Lanes, Lanes, Lanes, Lanes]
f32 = np.float32
_WORD = ir.IntType(32)


def _shuffle(builder: Any, x: Any, y: Any, lanes: list[int]) -> Any:
    kind = ir.VectorType(_WORD, len(lanes))
    order = ir.Constant(kind, [ir.Constant(_WORD, k) for k in lanes])
    return builder.shuffle_vector(x, y, order)


def _three(result: Vector) -> Any:
    return types.UniTuple(result, 3)


def _take(builder: Any, parts: list[Any], lanes: list[int]) -> Any:
    """Take lanes of three vectors numbered through."""
    n = parts[0].type.count
    first = _shuffle(
        builder, parts[0], parts[1], [k if k < 2 * n else 0 for k in lanes]
    )
    last = [n + k - 2 * n if k >= 2 * n else i for i, k in enumerate(lanes)]
    return _shuffle(builder, first, parts[2], last)


def _unzip3(typingctx: Any, a: Any, b: Any, c: Any) -> Any:
    """Sort three consecutive vectors of x, y, z, x, y, z ... into x, y and z."""
    sig = _three(a)(a, b, c)

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        n = sig.args[0].count
        sorted_ = [
            _take(builder, list(args), list(range(part, 3 * n, 3))) for part in range(3)
        ]
        return context.make_tuple(builder, sig.return_type, sorted_)

    return sig, generate


def _zip3(typingctx: Any, x: Any, y: Any, z: Any) -> Any:
    """Give the three vectors that lie one after the other as x, y, z, x, y, z ..."""
    sig = _three(x)(x, y, z)

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        n = sig.args[0].count
        order = [n * (k % 3) + k // 3 for k in range(3 * n)]
        mixed = [
            _take(builder, list(args), order[part * n : part * n + n])
            for part in range(3)
        ]
        return context.make_tuple(builder, sig.return_type, mixed)

    return sig, generate


def _gather_pairs(typingctx: Any, pairs: Any, index: Any) -> Any:
    """Take two neighbouring uint16 at every index as one i32, the first one low."""
    sig = index(pairs, index)

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        kind, count = sig.args[1].llvm, sig.args[1].count
        base = context.make_array(sig.args[0])(context, builder, args[0]).data
        base = builder.bitcast(base, ir.PointerType())
        at = builder.gep(base, [args[1]], source_etype=ir.IntType(16))
        # llvmlite gives a vector of addresses the type of one
        at.type = ir.VectorType(ir.PointerType(), count)
        every = ir.Constant(ir.VectorType(ir.IntType(1), count), [1] * count)
        rest = [at, ir.Constant(_WORD, 2), every, ir.Constant(kind, None)]
        name = f"llvm.masked.gather.v{count}i32.v{count}p0"
        called = ir.FunctionType(kind, [a.type for a in rest])
        gather = cgutils.get_or_insert_function(builder.module, called, name)
        return builder.call(gather, rest)

    return sig, generate


def _rows_alike(typingctx: Any, x: Any, rows: Any) -> Any:
    """Repeat a whole vector, as the rows of a block."""
    if not isinstance(rows, types.IntegerLiteral):
        return None
    times = rows.literal_value
    result: Any = Vector(x.element, x.count * times)

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        lanes = list(range(sig.args[0].count)) * times
        return _shuffle(builder, args[0], args[0], lanes)

    return result(x, rows), generate


unzip3: Callable[..., Three] = intrinsic(_unzip3)
zip3: Callable[..., Three] = intrinsic(_zip3)
gather_pairs: Callable[..., Lanes] = intrinsic(_gather_pairs)
rows_alike: Callable[..., Lanes] = intrinsic(prefer_literal=True)(_rows_alike)


@njit(cache=True, nogil=True, error_model="numpy")
def exp_negative(x: Lanes) -> Lanes:
    """Give exp(x) for x <= 0, to 1e-6 for x > -6."""
    y = maximum(x * f32(1.4426950408889634), f32(-126.0))
    # the shift may round k up or down, but what is left of y is exact
    k = to_whole(y + f32(127))
    r = y - to_real(k - 127)
    p = r * f32(1.8775767e-3) + f32(8.9893397e-3)
    p = p * r + f32(5.5826318e-2)
    p = p * r + f32(2.4015361e-1)
    p = p * r + f32(6.9315308e-1)
    p = p * r + f32(0.99999994)
    return p * as_f32(k << 23)


@njit(cache=True, nogil=True, error_model="numpy")
def smooth(t: Lanes) -> Lanes:
    """Give ``t t (3 - 2 t)``."""
    return t * t * (f32(3) - f32(2) * t)


@njit(cache=True, nogil=True, error_model="numpy")
def resolved(footprint: Lanes, per_wavelength: np.float32) -> Lanes:
    """Give how much of a wave a pixel shows: 1 to a quarter, 0 from half of it."""
    part = footprint * (f32(4) * per_wavelength) - f32(1)
    return f32(1) - smooth(minimum(maximum(part, f32(0)), f32(1)))
