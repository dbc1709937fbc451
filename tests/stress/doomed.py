"""A process whose children take part in a job and are killed at a step of it.

    python -m tests.stress.doomed          takes orders on standard input, JSON lines
    python -m tests.stress.doomed RANK STEP NTH --spool DIR ...
                                           is a worker; of its ranks under mpiexec the
                                           one of that number is killed

Children are forks: compiled kernels are loaded once. Each is ended by SIGKILL from
inside the code that takes the step, so that nothing is tidied up.
"""

import json
import os
import signal
import sys
from collections.abc import Callable
from pathlib import Path

import msgspec
import numpy as np
from msgspec import Struct

from renderers.art.job_steps import Step, reached
from renderers.snapshots.client import SnapshotClient
from renderers.snapshots.pruning import Pruner
from renderers.snapshots.request import ClassicWork, decode_request
from renderers.snapshots.spool import Spool
from renderers.snapshots.worker import run_worker


class Order(Struct):
    """What a child does, and the step at whose nth time it gets a signal.

    role: client (stores the array, publishes), canceller, worker or pruner; rehearsal
    is a client and a worker in this process itself, so that children find kernels
    compiled. signal: SIGKILL or SIGSTOP, none for step "".
    """

    spool: str
    role: str
    request: str = ""
    array: str = ""
    step: str = ""
    nth: int = 1
    signal: int = signal.SIGKILL
    lease_s: float = 0.05


class Outcome(Struct):
    """How a child ended: by which signal, or None; and the steps it took."""

    pid: int
    signal: int | None
    steps: list[str]


def doom(step: str, nth: int, number: int) -> Callable[[Step], None]:
    """Make a watcher that ends this process."""
    left = nth

    def watch(taken: Step) -> None:
        nonlocal left
        if taken.name == step:
            left -= 1
            if left == 0:
                os.kill(os.getpid(), number)

    return watch


def act(order: Order) -> None:
    """Play a role to its end."""
    folder = Path(order.spool)
    if order.role == "worker":
        run_worker(
            folder, once=True, threads=1, lease_s=order.lease_s, save_every_s=0.0
        )
        return
    if order.role == "pruner":
        Pruner(Spool(folder), 0.0, 0.0).prune()
        return
    request = decode_request(order.request.encode())
    client = SnapshotClient(folder)
    if order.role == "canceller":
        client.cancel(request.id)
        return
    assert isinstance(request.work, ClassicWork)
    assert client.put(np.load(order.array)) == request.work.volume
    client.submit(request)


def fork(order: Order) -> Outcome:
    """Let a child act; report when it has ended or stopped."""
    if order.role == "rehearsal":
        for role in ("client", "worker"):
            act(msgspec.structs.replace(order, role=role))
        return Outcome(os.getpid(), None, [])
    ours, its = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(ours)
        strike = doom(order.step, order.nth, order.signal)

        def watch(taken: Step) -> None:
            os.write(its, f"{taken.name}\n".encode())
            strike(taken)

        reached.watcher = watch
        try:
            act(order)
        except BaseException as error:
            print(f"{type(error).__name__}: {error}", file=sys.stderr, flush=True)
            os._exit(1)
        os._exit(0)
    os.close(its)
    _, status = os.waitpid(child, os.WUNTRACED)
    if os.WIFSTOPPED(status):
        os.close(ours)
        return Outcome(child, os.WSTOPSIG(status), [])
    with os.fdopen(ours) as told:
        steps = told.read().split()
    if os.WIFSIGNALED(status):
        return Outcome(child, os.WTERMSIG(status), steps)
    if os.WEXITSTATUS(status):
        raise SystemExit(f"a child failed at {order}")
    return Outcome(child, None, steps)


def awaken(pid: int) -> Outcome:
    """Let a stopped child go on to its end."""
    os.kill(pid, signal.SIGCONT)
    _, status = os.waitpid(pid, 0)
    ended = os.WTERMSIG(status) if os.WIFSIGNALED(status) else None
    return Outcome(pid, ended, [])


def take_orders() -> None:
    """Fork a child for each line; a line that is a number awakens a stopped one."""
    for line in sys.stdin:
        record = json.loads(line)
        if isinstance(record, int):
            outcome = awaken(record)
        else:
            outcome = fork(msgspec.convert(record, Order))
        print(msgspec.json.encode(outcome).decode(), flush=True)


def main() -> int:
    """Do as the command line says."""
    if len(sys.argv) == 1:
        take_orders()
        return 0
    from renderers.snapshots.__main__ import main as work

    victim, step, nth, *words = sys.argv[1:]
    if os.environ.get("PMI_RANK", os.environ.get("OMPI_COMM_WORLD_RANK")) == victim:
        reached.watcher = doom(step, int(nth), signal.SIGKILL)
    return work(words)


if __name__ == "__main__":
    sys.exit(main())
