"""What became different in a scene that changes while it is drawn."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np
from numpy.typing import NDArray


class ChangeKind(Enum):
    """Name what changed: tissue was cut or filled, bent, wet otherwise, or tinted."""

    CUT = "cut"
    DENT = "dent"
    FILM = "film"
    TINT = "tint"


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


def merged(changes: Iterable[Change]) -> list[Change]:
    """Return fewer changes that say the same, by rising generation.

    Boxes of one kind become one where that has no more voxels than both. Whoever brings
    something up to date reads the arrays as they are by then, so that the order of
    changes that are told together does not matter.
    """
    found: list[Change] = []
    for change in changes:
        for place, other in enumerate(found):
            low = np.minimum(other.low, change.low)
            high = np.maximum(other.high, change.high)
            both = _voxels(other.low, other.high) + _voxels(change.low, change.high)
            if other.kind is change.kind and _voxels(low, high) <= both:
                del found[place]
                change = replace(change, low=low, high=high)
                break
        found.append(change)
    return found


def _voxels(low: NDArray[np.int64], high: NDArray[np.int64]) -> int:
    return int(np.prod(high - low + 1))


def changed_box(
    before: NDArray[np.generic], after: NDArray[np.generic]
) -> tuple[NDArray[np.int64], NDArray[np.int64]] | None:
    """Return the first and last voxel, (i, j, k), whose bits differ; None for none.

    before, after: of one shape ``(nz, ny, nx)`` and type.
    """
    bits = np.dtype(f"u{after.dtype.itemsize}")
    differs = before.view(bits) != after.view(bits)
    ends = []
    for axis in (2, 1, 0):
        others = tuple(other for other in range(3) if other != axis)
        places = np.flatnonzero(differs.any(axis=others))
        if not len(places):
            return None
        ends.append((places[0], places[-1]))
    low, high = np.array(ends, np.int64).T
    return low, high
