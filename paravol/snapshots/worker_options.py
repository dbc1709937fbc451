"""How a snapshot worker works. Nothing heavy is imported here."""

import math
from dataclasses import dataclass
from typing import Literal

from system import UserError


@dataclass(frozen=True, kw_only=True, slots=True)
class WorkerOptions:
    """Set up a worker. None: the worker's default."""

    ranks: int = 1
    """MPI processes; 1 renders without MPI."""
    threads: int | None = None
    """Threads that trace (without MPI), shade and expose; 2 by default."""
    dataflow: Literal["shared", "migrating", "static", "replicated"] | None = None
    """How ranks share the volume's cells: in shared memory (the default on one
    machine), migrating as in the 1995 paper (on several), static, or the whole volume
    on every rank."""
    from_file: bool = False
    """No rank has to keep cells, which are read from the volume's file: for volumes
    larger than all memory."""
    cache_cells: int | None = None
    """Cells that a rank keeps at most; all by default."""
    memory_gb: float | None = None
    """Memory that a rank, or each of several machines, may take beside the volume, GB,
    which says how many cells are kept; half of the machine's by default."""
    lease: float | None = None
    """Seconds of silence until a worker counts as dead, 15 by default; 60 on a network
    disk."""
    keep_days: float | None = None
    """Days that finished jobs stay in the folder, 7 by default."""
    once: bool = False
    """Stop when nothing is left that no living worker does."""

    def check(self) -> None:
        """Raise UserError for what makes no sense."""
        for name in ("ranks", "threads", "cache_cells"):
            value = getattr(self, name)
            if value is not None and value < 1:
                option = name.replace("_", "-")
                raise UserError(f"--{option} must be at least 1, got {value}")
        if self.lease is not None and not 0 < self.lease < math.inf:
            raise UserError(f"--lease must be a positive time, got {self.lease:g}")
        if self.keep_days is not None and not 0 <= self.keep_days < math.inf:
            raise UserError(f"--keep-days must not be negative, got {self.keep_days}")
        if self.memory_gb is not None and not 0 < self.memory_gb < math.inf:
            raise UserError(f"--memory-gb must be above 0, got {self.memory_gb:g}")
        if self.dataflow == "shared" and (self.cache_cells or self.from_file):
            raise UserError(
                "Ranks that share memory keep all cells: leave --cache-cells and "
                "--from-file out, or take another --dataflow than shared."
            )
        of_ranks = self.dataflow, self.cache_cells, self.from_file, self.memory_gb
        if self.ranks == 1 and any(of_ranks):
            raise UserError(
                "--dataflow, --cache-cells, --from-file and --memory-gb say how ranks "
                "share cells; take more --ranks than 1 with them."
            )

    def arguments(self) -> list[str]:
        """Return these options as arguments of `python -m renderers.snapshots`."""
        found = []
        names = "threads", "dataflow", "cache_cells", "memory_gb", "lease", "keep_days"
        for name in (*names, "once", "from_file"):
            value = getattr(self, name)
            if value is not None and value is not False:
                found.append(f"--{name.replace('_', '-')}")
                found += [] if value is True else [str(value)]
        return found
