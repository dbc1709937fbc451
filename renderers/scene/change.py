"""What became different in a scene that changes while it is drawn."""

from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray


class ChangeKind(Enum):
    """Name what changed: tissue was cut or filled, was bent, or is wet otherwise."""

    CUT = "cut"
    DENT = "dent"
    FILM = "film"


@dataclass(frozen=True, slots=True)
class Change:
    """Tell which voxels of a scene's fields became different.

    Whoever edits arrays of a scene in place says so with one of these, and whatever
    was derived from them is brought up to date. generation: counts the changes of a
    scene, 1 for the first; it never runs backwards, not even when an edit is undone.
    low, high: ``(3,)`` int64, the first and last changed voxel, (i, j, k).
    """

    generation: int
    low: NDArray[np.int64]
    high: NDArray[np.int64]
    kind: ChangeKind = ChangeKind.CUT
