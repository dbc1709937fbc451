"""What threads share inside compiled code: turns to take, and signals to wait for.

A compiled function of thirty arguments takes Python five to ten microseconds to call,
one thread at a time; with turns it is called once per thread and not once per part.
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


def _first(context: Any, builder: Any, array: Any, value: Any) -> Any:
    return cgutils.create_struct_proxy(array)(context, builder, value).data


def _is_shared(array: Any) -> bool:
    return isinstance(array, types.Array) and array.dtype == types.int64


def _take_turn(typingctx: Any, turns: Any) -> Any:
    """Add one to the first element of an int64 array; give what it was before.

    One step: no two threads get the same turn.
    """
    return _changed_by(turns, "add", "monotonic")


def _give_back(typingctx: Any, turns: Any) -> Any:
    """Take one from the first element of an int64 array; give what it was before.

    Whoever sees that sees all that was written before it.
    """
    return _changed_by(turns, "sub", "acq_rel")


def _changed_by(turns: Any, operation: str, order: str) -> Any:
    if not _is_shared(turns):
        return None

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        at = _first(context, builder, sig.args[0], args[0])
        one = ir.Constant(ir.IntType(64), 1)
        return builder.atomic_rmw(operation, at, one, order)

    return signature(types.int64, turns), generate


def _look(typingctx: Any, shared: Any) -> Any:
    """Read the first element of an int64 array anew, after a short rest."""
    if not _is_shared(shared):
        return None

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        if builder.module.triple.startswith("x86_64"):
            kind = ir.FunctionType(ir.VoidType(), [])
            name = "llvm.x86.sse2.pause"
            pause = cgutils.get_or_insert_function(builder.module, kind, name)
            builder.call(pause, [])
        at = _first(context, builder, sig.args[0], args[0])
        return builder.load_atomic(at, "acquire", 8)

    return signature(types.int64, shared), generate


take_turn: Any = intrinsic(_take_turn)
give_back: Any = intrinsic(_give_back)
look: Any = intrinsic(_look)


@njit(cache=True, nogil=True)
def wait_for_change(shared: I64, value: int, looks: int) -> bool:
    """Look until the first element is another, so often at most; say whether it is."""
    while looks > 0 and look(shared) == value:
        looks -= 1
    return looks > 0


@njit(cache=True)
def count_up(shared: I64) -> None:
    """Add one in one step, as compiled code that does not hold the lock does."""
    take_turn(shared)


@njit(cache=True, nogil=True)
def leave_and_wait(busy: I64, shared: I64, value: int, looks: int) -> bool:
    """Take one from those who are busy; then do as `wait_for_change`."""
    give_back(busy)
    return wait_for_change(shared, value, looks)
