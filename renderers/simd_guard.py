"""Whether compiled vectors can be trusted on this machine.

Vectors reach into numba's and LLVM's insides, which another version may have
changed. So they are tried out when first wanted: one kernel with every kind of
instruction against numpy, bit by bit. Where that fails, renderers take scalar
kernels: slower, the same picture but for rounding.
"""

import logging
from functools import cache


class VectorError(RuntimeError):
    """Something has no scalar kernels to fall back on; the text says what helps."""


_log = logging.getLogger(__name__)


@cache
def vector_problem() -> str:
    """Say why vector kernels cannot be used here; empty where they can.

    The first call of a process tries them out (10 ms; 2 s where the kernel has to
    be compiled) and logs a warning where they fail.
    """
    problem = _try_out()
    if problem:
        _log.warning("Pictures take longer: vector kernels do not run. %s", problem)
    return problem


def demand_vectors(what: str) -> None:
    """Raise VectorError where vectors cannot be used; `what` needs them."""
    problem = vector_problem()
    if problem:
        raise VectorError(
            f"{what} needs vector kernels, which do not run here. {problem} The "
            "versions in requirements.lock are known to work."
        )


def _try_out() -> str:
    # Any error of a compiler that is not the one we know: its kind is unknown too.
    try:
        from renderers.lanes.self_check import agrees_with_scalars

        agrees = agrees_with_scalars()
    except Exception as error:
        first = str(error).strip().partition("\n")[0]
        return f"This numba does not compile them ({type(error).__name__}: {first})."
    return "" if agrees else "This numba compiles them to wrong results."
