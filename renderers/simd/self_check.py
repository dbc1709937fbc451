"""Whether compiled vectors can be trusted on this machine.

Vectors reach into numba's and LLVM's insides, which another version may have changed.
So they are tried out when first wanted: one kernel with every kind of instruction
against numpy, bit by bit. Where that fails, nothing is drawn.
"""

from functools import cache
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.simd.cell_reads import cell4
from renderers.simd.functions import (
    absolute,
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
    i32,
    lanes,
    lowest,
    maximum,
    minimum,
    rank,
    select,
    sqrt,
)
from renderers.simd.load_store import (
    gather,
    gather_u8,
    load,
    load_where,
    prefetch,
    store,
)
from renderers.simd.records import put_rows4, rows4

F32 = NDArray[np.float32]
I32 = NDArray[np.int32]

_WIDTH = 16
_RESULTS = 15


class VectorError(RuntimeError):
    """Vectors do not compile here; the text says what helps."""


@cache
def vector_problem() -> str:
    """Return why vectors cannot be used here; empty where they can.

    The first call of a process tries them out (10 ms; 2 s where the kernel has to be
    compiled).
    """
    # Any error of a compiler that is not the one we know: its kind is unknown too.
    try:
        agrees = agrees_with_numpy()
    except Exception as error:
        first = str(error).strip().partition("\n")[0]
        return f"This numba does not compile them ({type(error).__name__}: {first})."
    return "" if agrees else "This numba compiles them to wrong results."


def require_vectors(what: str) -> None:
    """Raise VectorError where vectors cannot be used; `what` needs them."""
    problem = vector_problem()
    if problem:
        raise VectorError(
            f"{what} needs vector kernels, which do not run here. {problem} The "
            "versions in requirements.lock are known to work."
        )


@njit(cache=True, nogil=True, error_model="numpy")
def _vectors(
    x: F32, y: F32, n: I32, quads: Any, small: Any, out: F32, table: F32
) -> int:
    a = load(x, 0, _WIDTH)
    b = load(y, 0, _WIDTH)
    index = load(n, 0, _WIDTH)
    c = a * b + a
    c += b / (absolute(a) + 1.0)
    store(out, 0, c - 3.0)
    store(out, 16, sqrt(absolute(b)))
    store(out, 32, floor(a) + maximum(a, b) * minimum(a, 0.5))
    mask = ((a < b) & (b != 1.0)) | ~(a >= -2.0)
    store(out, 48, select(mask, a, -b))
    store(out, 64, f32(rank(mask)))
    store(out, 80, f32(f64(a) / 3.0))
    store(out, 96, as_f32(as_i32(a) ^ 1))
    store(out, 112, f32(((i32(a) << 3) - (index >> 1)) & 255))
    store(out, 128, gather(x, index, mask))
    store(out, 144, f32(gather_u8(small, index, mask)))
    store(out, 160, load_where(y, 0, lanes(_WIDTH) < 5) + full(x[0], _WIDTH))
    p, q, r, s = rows4(table, index)
    store(out, 176, (p - q) * r + s)
    put_rows4(table, index + 16, s, r, q, p)
    half = full(np.float32(0.5), _WIDTH)
    p, q, r, s = cell4(quads, index, 2, 4, half, half, half)
    store(out, 192, p + q)
    store(out, 208, r - s)
    # whole numbers: the same whether rounded once or twice
    store(out, 224, fma(f32(index), 3.0, f32(lanes(_WIDTH))))
    if not any_(mask):
        return -1
    prefetch(x, 1 << 20)
    return int(bits(mask) * 10000 + lowest(bits(mask)) * 100 + count(mask))


def agrees_with_numpy() -> bool:
    """Run every kind of instruction and compare with numpy, bit by bit.

    Raises whatever numba does where its insides are not those we know.
    """
    k = np.arange(_WIDTH)
    x = np.sin(k * 1.7).astype(np.float32) * np.float32(7)
    y = np.cos(k * 0.9).astype(np.float32) * np.float32(5)
    n = (k * 5 % _WIDTH).astype(np.int32)
    quads = (k[:, None] * 37 + np.arange(4) * 11).astype(np.int16)
    quads = np.concatenate([quads, quads, quads])
    small = (np.arange(_WIDTH + 4) * 7).astype(np.uint8)
    table = np.sin(np.arange(128, dtype=np.float32)).reshape(32, 4)
    given = table.copy()
    out = np.zeros(_RESULTS * _WIDTH, np.float32)
    word = _vectors(x, y, n, quads, small, out, table)
    mask = ((x < y) & (y != 1)) | ~(x >= -2)
    numbers = sum(int(m) << i for i, m in enumerate(mask))
    rows = given[n]
    # the middle of a cell: pairs along y weighted 16383 and 16384, then two halves
    corner = quads.astype(np.int64)[n[:, None] + np.array([0, 2, 4, 6, 1, 3, 5, 7])]
    weight = np.array([16383, 16384])
    lines = (corner.reshape(-1, 4, 2, 4) * weight[:, None]).sum(2).astype(np.float32)
    half = np.float32(0.5)
    front = lines[:, ::2] + half * (lines[:, 1::2] - lines[:, ::2])
    cells = front[:, 0] + half * (front[:, 1] - front[:, 0])
    wanted = [
        x * y + x + y / (np.abs(x) + np.float32(1)) - np.float32(3),
        np.sqrt(np.abs(y)),
        np.floor(x) + np.where(x > y, x, y) * np.where(x < half, x, half),
        np.where(mask, x, -y),
        np.cumsum(mask) - mask,
        x.astype(np.float64) / 3,
        (x.view(np.int32) ^ 1).view(np.float32),
        ((x.astype(np.int32) << 3) - (n >> 1)) & 255,
        np.where(mask, x[n], 0),
        np.where(mask, small[n], 0),
        np.where(k < 5, y, 0) + x[0],
        (rows[:, 0] - rows[:, 1]) * rows[:, 2] + rows[:, 3],
        cells[:, 0] + cells[:, 1],
        cells[:, 2] - cells[:, 3],
        n * 3 + k,
    ]
    given[n + 16] = rows[:, ::-1]
    return bool(
        word == numbers * 10000 + np.argmax(mask) * 100 + mask.sum()
        and np.array_equal(out, np.concatenate(wanted).astype(np.float32))
        and np.array_equal(table, given)
    )
