"""What threads share inside compiled code: turns to take, and signals to wait for.

A compiled function of thirty arguments takes Python five to ten microseconds to call,
one thread at a time; with turns it is called once per thread and not once per part.
"""

from typing import Any

from numba import njit, types
from numba.core.typing.templates import signature

from renderers.simd.arrays import Longs
from renderers.simd.vector import I64, call_llvm, ir, vector_function


def _changed_by(counter: Any, operation: str, order: str) -> Any:
    if not _is_shared(counter):
        return None

    def emit(builder: Any, base: Any) -> Any:
        at = builder.bitcast(base, I64.as_pointer())
        return builder.atomic_rmw(operation, at, I64(1), order)

    return signature(types.int64, counter), emit


def _is_shared(array: Any) -> bool:
    return isinstance(array, types.Array) and array.dtype == types.int64


@vector_function
def fetch_add(turns: Any) -> Any:
    """Add one to the first element of an int64 array; return what it was before.

    Atomic: no two threads get the same number.
    """
    return _changed_by(turns, "add", "monotonic")


@vector_function
def give_back(turns: Any) -> Any:
    """Take one from the first element of an int64 array; return what it was before.

    Whoever sees that sees all that was written before it.
    """
    return _changed_by(turns, "sub", "acq_rel")


@vector_function
def look(shared: Any) -> Any:
    """Read the first element of an int64 array anew, after a short rest."""
    if not _is_shared(shared):
        return None

    def emit(builder: Any, base: Any) -> Any:
        if builder.module.triple.startswith("x86_64"):
            call_llvm(builder, "llvm.x86.sse2.pause", ir.VoidType(), [])
        at = builder.bitcast(base, I64.as_pointer())
        return builder.load_atomic(at, "acquire", 8)

    return signature(types.int64, shared), emit


@njit(cache=True, nogil=True)
def wait_for_change(shared: Longs, value: int, looks: int) -> bool:
    """Look until the first element is another, so often at most; say whether it is."""
    while looks > 0 and look(shared) == value:
        looks -= 1
    return looks > 0


@njit(cache=True)
def count_up(shared: Longs) -> None:
    """Add one in one step, as compiled code that does not hold the lock does."""
    fetch_add(shared)


@njit(cache=True, nogil=True)
def leave_and_wait(busy: Longs, shared: Longs, value: int, looks: int) -> bool:
    """Take one from those who are busy; then do as `wait_for_change`."""
    give_back(busy)
    return wait_for_change(shared, value, looks)
