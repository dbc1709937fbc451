"""How ranks share the cells of a volume: the ways of the literature, one code."""

from dataclasses import dataclass
from enum import Enum


class Dataflow(Enum):
    """Choose who has which cells.

    REPLICATED: every rank the whole volume; nothing is sent. STATIC: each cell stays
    with its home, which sends copies: object dataflow before the 1995 paper. MIGRATING:
    the paper's, cells move to where they are used and homes only know where they are.
    SHARED: ranks of one
    machine keep one copy, to which each adds what it needs; nothing is sent.
    """

    REPLICATED = "replicated"
    STATIC = "static"
    MIGRATING = "migrating"
    SHARED = "shared"


@dataclass(frozen=True, slots=True)
class CellPolicy:
    """Set how ranks share cells.

    cache_cells: that a rank keeps; None for all. from_file: no rank has to keep cells:
    homes read from the volume's file, static ones each time they are asked, migrating
    ones where nobody has the cell. memory_bytes: that each rank may take beside the
    volume, which chooses cache_cells where that is None. None for half of the machine's
    memory, for all together that are on it.
    """

    cache_cells: int | None = None
    dataflow: Dataflow = Dataflow.MIGRATING
    from_file: bool = False
    memory_bytes: int | None = None
