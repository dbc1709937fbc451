"""A clock that compiled code can read: what each of its stages takes.

A call that does all of a picture returns to Python once, so that Python's clocks see
the whole of it only.
"""

from typing import Any

import numpy as np
from llvmlite import ir
from numba import njit, types
from numba.core import cgutils
from numba.core.typing.templates import signature
from numba.extending import intrinsic
from numpy.typing import NDArray

I64 = NDArray[np.int64]

_WORD = ir.IntType(64)


def _ticks(typingctx: Any) -> Any:
    """Read the processor's time stamp counter, which runs at one speed.

    Where no counter is known it is always zero.
    """

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        kind = ir.FunctionType(_WORD, [])
        triple = builder.module.triple
        if triple.startswith("x86_64"):
            name = "llvm.readcyclecounter"
            counter = cgutils.get_or_insert_function(builder.module, kind, name)
            return builder.call(counter, [])
        if triple.startswith(("aarch64", "arm64")):
            # the cycle counter proper is the kernel's; this one any program may read
            code = "mrs $0, cntvct_el0"
            return builder.asm(kind, code, "=r", [], side_effect=True)
        return ir.Constant(_WORD, 0)

    return signature(types.int64), generate


ticks: Any = intrinsic(_ticks)


@njit(cache=True, nogil=True, inline="always")
def passed(spent: I64, stage: int, last: int) -> int:
    """Add what has passed since `last` to a stage; give the time it is now."""
    now: int = ticks()
    spent[stage] += now - last
    return now
