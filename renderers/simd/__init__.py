"""Vectors for compiled kernels: packets of pixels, rays or splats as plain Python.

A vector has a fixed number of lanes of ``f32 f64 i32 i64`` or of a mask; operators
and the functions here work lane by lane, numbers are spread over the lanes. Nothing is
reordered, and nothing fused but by `fma`: the same bits for any width and, but for
`fma`, on any processor. Import this in files of kernels only; whoever calls these
first demands of `renderers.simd.self_check` that vectors compile here.
"""

from renderers.simd.cell_reads import cell1, cell4
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
    fma,
    full,
    greatest,
    i32,
    i64,
    lanes,
    least,
    lowest,
    maximum,
    minimum,
    rank,
    select,
    sqrt,
)
from renderers.simd.interleaved import (
    copy_rows4,
    gather_pairs,
    rows_alike,
    swapped,
    unzip3,
    zip3,
)
from renderers.simd.load_store import (
    gather,
    gather_u8,
    load,
    load_where,
    prefetch,
    spread,
    store,
    store_where,
)
from renderers.simd.packing import store_packed
from renderers.simd.records import (
    load_triples,
    put_rows4,
    row,
    rows4,
    rows8,
    store_groups,
    store_quads,
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
    "copy_rows4",
    "count",
    "f32",
    "f64",
    "floor",
    "fma",
    "full",
    "gather",
    "gather_pairs",
    "gather_u8",
    "greatest",
    "i32",
    "i64",
    "lanes",
    "least",
    "load",
    "load_triples",
    "load_where",
    "lowest",
    "maximum",
    "minimum",
    "prefetch",
    "put_rows4",
    "rank",
    "row",
    "rows4",
    "rows8",
    "rows_alike",
    "select",
    "spread",
    "sqrt",
    "store",
    "store_groups",
    "store_packed",
    "store_quads",
    "store_spread",
    "store_triples",
    "store_where",
    "swapped",
    "unzip3",
    "zip3",
]
