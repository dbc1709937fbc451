"""`paravol worker`: serve snapshot requests from a spool folder."""

from dataclasses import replace
from pathlib import Path
from typing import Annotated

from app.cli.root import FLATTENED, Flag, Oversubscribe, rank_count
from paravol.snapshots.spool_folder import require_spool
from paravol.snapshots.worker_options import WorkerOptions

ONE_RANK = WorkerOptions()


def worker(
    *,
    spool: Path,
    create: Flag = False,
    options: Annotated[WorkerOptions, FLATTENED] = ONE_RANK,
    oversubscribe: Oversubscribe = False,
) -> int:
    """Serve snapshot requests from a spool folder.

    Several workers may serve one folder, on several machines if they share its disk.
    One that dies loses no request: another takes its job over.

    Parameters
    ----------
    spool
        Folder shared with the program that asks for snapshots.
    create
        Make the folder if it is missing.
    """
    from paravol.snapshots.rendering_service import run_worker_command

    require_spool(spool, create=create)
    ranks = rank_count(options.ranks, oversubscribe=oversubscribe)
    return run_worker_command(spool, replace(options, ranks=ranks))
