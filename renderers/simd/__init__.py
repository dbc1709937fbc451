"""Vectors for compiled kernels: packets of pixels, rays or splats as plain Python.

A vector has a fixed number of lanes of ``f32 f64 i32 i64`` or of a mask; operators
and the functions here work lane by lane, numbers are spread over the lanes. No fused
or reordered arithmetic: the same bits for any width and on any processor. Import this
in files of kernels only, and use those through `renderers.simd_guard`.
"""

from renderers.simd.cells import cell1, cell4
from renderers.simd.functions import (
    absolute,
    all_,
    any_,
    as_f32,
    as_i32,
    bits,
    count,
    f32,
    f64,
    floor,
    full,
    greatest,
    i32,
    i64,
    lanes,
    least,
    maximum,
    minimum,
    rank,
    select,
    sqrt,
)
from renderers.simd.interleaved import gather_pairs, rows_alike, unzip3, zip3
from renderers.simd.memory import (
    gather,
    gather_u8,
    load,
    load_where,
    store,
    store_packed,
    store_where,
)
from renderers.simd.rows import (
    in_row,
    load_triples,
    put_rows4,
    row,
    rows4,
    rows8,
    store_groups,
    store_spread,
    store_triples,
)
from renderers.simd.vector import Vector

__all__ = [
    "Vector",
    "absolute",
    "all_",
    "any_",
    "as_f32",
    "as_i32",
    "bits",
    "cell1",
    "cell4",
    "count",
    "f32",
    "f64",
    "floor",
    "full",
    "gather",
    "gather_pairs",
    "gather_u8",
    "greatest",
    "i32",
    "i64",
    "in_row",
    "lanes",
    "least",
    "load",
    "load_triples",
    "load_where",
    "maximum",
    "minimum",
    "put_rows4",
    "rank",
    "row",
    "rows4",
    "rows8",
    "rows_alike",
    "select",
    "sqrt",
    "store",
    "store_groups",
    "store_packed",
    "store_spread",
    "store_triples",
    "store_where",
    "unzip3",
    "zip3",
]
