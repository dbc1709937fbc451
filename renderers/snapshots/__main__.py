"""A snapshot worker as a process: on its own, or as one of the ranks of mpiexec.

python -m renderers.snapshots --spool DIR
mpiexec -n 2 python -m mpi4py -m renderers.snapshots --spool DIR
"""

import argparse
import os
import signal
import sys
from collections.abc import Callable
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING

from renderers.art.crew import ALONE, Crew, MachineCrew
from renderers.art.ranks.policy import CellPolicy, Dataflow
from renderers.art.ranks.transport import TransportError
from renderers.snapshots.launcher import expect_company, launched_ranks
from renderers.snapshots.lease import LEASE_S
from renderers.snapshots.pruning import KEEP_S
from renderers.snapshots.spool import SAVE_EVERY_S, SpoolError
from system import is_alive

if TYPE_CHECKING:
    from renderers.art.ranks.mpi import MpiTransport
    from renderers.snapshots.team import Team

DAY_S = 86_400.0


class _Ending:
    """Know when to end: on a signal, or when the parent is gone."""

    def __init__(self, parent: int | None) -> None:
        self._parent = parent
        self._asked = False
        for number in (signal.SIGTERM, signal.SIGINT):
            signal.signal(number, self._on_signal)

    def __call__(self) -> bool:
        return self._asked or not self._parent_lives()

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        if self._asked:
            # Asked twice: leave at once. The job is taken over by the next worker.
            os._exit(128 + number)
        self._asked = True

    def _parent_lives(self) -> bool:
        return self._parent is None or is_alive(self._parent)


def main(arguments: list[str] | None = None) -> int:
    """Run the worker; return the exit status."""
    options = _parsed(arguments)
    ending = _Ending(options.parent)

    def serve(team: "Team | None" = None, threads: int = 2) -> None:
        from renderers.snapshots.worker import run_worker

        run_worker(
            options.spool,
            once=options.once,
            team=team,
            threads=options.threads or threads,
            lease_s=options.lease,
            keep_s=options.keep_days * DAY_S,
            save_every_s=options.save_every,
            stopped=ending,
        )

    try:
        if options.backend == "mpi" or (
            options.backend == "auto" and launched_ranks() > 1
        ):
            return _run_ranks(options, serve)
        serve()
    except (SpoolError, TransportError, ValueError) as error:
        print(error, file=sys.stderr)
        return 1
    return 0


def _parsed(arguments: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="python -m renderers.snapshots",
        description="Serve snapshot requests from a spool folder.",
    )
    add = parser.add_argument
    add("--spool", type=Path, required=True, help="the spool folder")
    told = "stop when nothing is left that no living worker does"
    add("--once", action="store_true", help=told)
    told = "auto takes MPI when started by mpiexec with several ranks"
    add("--backend", choices=("auto", "serial", "mpi"), default="auto", help=told)
    told = "threads of a serial worker, or of each machine's; 2, or all of a machine's"
    add("--threads", type=int, help=told)
    add("--cache-cells", type=int, help="cells a rank keeps; all by default")
    told = (
        "memory a rank may take beside the volume, GB, or each of several machines; it "
        "says how many cells are kept"
    )
    add("--memory-gb", type=float, help=told)
    flows = [flow.value for flow in Dataflow]
    told = "how ranks share cells: usually shared on one machine, else migrating"
    add("--dataflow", choices=flows, help=told)
    told = "no rank has to keep cells: homes read them from the volume's file"
    add("--from-file", action="store_true", help=told)
    told = "seconds until a worker counts as dead; 60 on a network disk"
    add("--lease", type=float, default=LEASE_S, help=told)
    told = "days that finished jobs stay in the spool folder"
    add("--keep-days", type=float, default=KEEP_S / DAY_S, help=told)
    told = "seconds after which finished rays are saved for who takes the job over"
    add("--save-every", type=float, default=SAVE_EVERY_S, help=told)
    add("--parent", type=int, help="process id; end when that process is gone")
    return parser.parse_args(arguments)


def _policy(options: argparse.Namespace, transport: "MpiTransport") -> CellPolicy:
    """Return how ranks share cells: as was said, else as is quickest."""
    moves = options.cache_cells is not None or options.from_file
    usual = Dataflow.MIGRATING
    if transport.is_one_machine and not moves:
        usual = Dataflow.SHARED
    flow = usual if options.dataflow is None else Dataflow(options.dataflow)
    if flow is Dataflow.SHARED and not transport.is_one_machine:
        raise TransportError(
            "ranks on several machines share no memory; start the worker with another "
            "--dataflow than shared"
        )
    bytes_ = None if options.memory_gb is None else int(options.memory_gb * 1e9)
    return CellPolicy(options.cache_cells, flow, options.from_file, bytes_)


def _run_ranks(
    options: argparse.Namespace, serve: "Callable[[Team, int], None]"
) -> int:
    try:
        from renderers.art.ranks.mpi import MpiTransport
    except ImportError as error:
        raise TransportError(
            f"MPI cannot be used: {error}; install the extra `mpi`."
        ) from error
    from renderers.art.ranks.rank import Rank
    from renderers.scene.thread_pool import ThreadPool
    from renderers.snapshots.data_store import DataStore
    from renderers.snapshots.team import RankTeam, follow

    transport = MpiTransport(
        folder=options.spool, one_a_machine=options.dataflow is None
    )
    expect_company(transport.launched)
    if transport.is_idle:
        transport.close()
        return 0
    threads = 1
    policy, crew = _policy(options, transport), ALONE
    if policy.dataflow is Dataflow.SHARED:
        crew = MachineCrew(transport)
    elif not transport.is_one_machine:
        threads = options.threads or transport.processors
        crew = Crew(ThreadPool(threads).map)
    # who shares memory, or has threads, need not look for messages all the time
    packets = 4 if crew.is_shared else 2 * threads
    rank = Rank(transport, threads, packets)
    status = 0
    try:
        if transport.rank > 0:
            follow(rank, DataStore(options.spool / "data"), policy, crew)
        else:
            team = RankTeam(rank, policy, crew)
            try:
                serve(team, max(threads, 2))
            except SpoolError as error:
                print(error, file=sys.stderr, flush=True)
                team.dismiss()
                status = 1
    except TransportError as error:
        # The ranks no longer understand each other: none may be left waiting.
        print(error, file=sys.stderr, flush=True)
        transport.abort()
    transport.close()
    return status


if __name__ == "__main__":
    sys.exit(main())
