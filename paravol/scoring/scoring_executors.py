"""Who scores a batch: this process, several, or the ranks of an MPI job."""

import multiprocessing
import signal
from collections.abc import Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager

from system import UserError


@contextmanager
def scoring_executor(jobs: int, *, mpi: bool) -> Iterator[Executor | None]:
    """Return an executor, None for this process alone; Ctrl-C ends what is waiting.

    jobs: processes. mpi: the ranks of `mpiexec -n N python -m mpi4py.futures`.
    UserError where mpi4py is missing.
    """
    if mpi:
        executor: Executor = _ranks()
    elif jobs > 1:
        # spawned: a fork would share locks of compiled threads
        executor = ProcessPoolExecutor(
            jobs,
            mp_context=multiprocessing.get_context("spawn"),
            initializer=_leave_interrupts,
        )
    else:
        yield None
        return
    try:
        yield executor
    except BaseException:
        executor.shutdown(wait=False, cancel_futures=True)
        raise
    executor.shutdown()


def _ranks() -> Executor:
    try:
        from mpi4py.futures import MPIPoolExecutor
    except ImportError as error:
        raise UserError(
            "--mpi needs mpi4py and an MPI; install the extra of the name mpi, or use "
            "--jobs."
        ) from error
    executor: Executor = MPIPoolExecutor()
    return executor


def _leave_interrupts() -> None:
    """Let the parent alone hear Ctrl-C; it ends its children."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
