"""How far the cavity that was cut lies from an expert's."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.spatial import cKDTree

from renderers.scene import Volume
from scenarios.metrics.measured import Measured
from scenarios.metrics.metric import PATIENT, Definition, Found
from scenarios.metrics.removal import NOBODY

Doubles = NDArray[np.float64]

NO_EXPERT = "there is no expert's operation to compare with"


@dataclass(frozen=True)
class Cavity:
    """The tissue that was taken, in voxels of the head's grid.

    voxels: ``(n,)`` their flat numbers, ascending. rim_mm: ``(m, 3)`` LPS middles of
    those that have a neighbour which was not taken. spacing_mm: of the grid.
    """

    voxels: NDArray[np.int64]
    rim_mm: Doubles
    spacing_mm: float

    @classmethod
    def between(cls, before: Volume, after: Volume) -> "Cavity":
        """Take what was tissue and is air; both signed air distances of one grid."""
        taken = (before.values > 0.0) & (after.values <= 0.0)
        # what is at the grid's end has no neighbour there
        inner = ndimage.binary_erosion(taken)
        k, j, i = np.nonzero(taken & ~inner)
        matrix = before.world_from_voxel
        rim = np.stack([i, j, k], axis=1) @ matrix[:3, :3].T + matrix[:3, 3]
        spacing = float(before.spacing_mm.max())
        return cls(np.flatnonzero(taken), np.asarray(rim, np.float64), spacing)


def mean_mm(one: Cavity, other: Cavity) -> float:
    """Return the mean distance of either rim's voxels to the other rim."""
    there, back = _distances(one, other)
    return float(np.concatenate([there, back]).mean())


def hausdorff_mm(one: Cavity, other: Cavity) -> float:
    """Return the largest distance of a voxel of either rim to the other rim."""
    there, back = _distances(one, other)
    return float(max(there.max(), back.max()))


def overlap(one: Cavity, other: Cavity) -> float:
    """Return Dice's coefficient: twice what both took, by the sum of each."""
    shared = len(np.intersect1d(one.voxels, other.voxels, assume_unique=True))
    return 2.0 * shared / (len(one.voxels) + len(other.voxels))


def _distances(one: Cavity, other: Cavity) -> tuple[Doubles, Doubles]:
    there, _ = cKDTree(other.rim_mm).query(one.rim_mm)
    back, _ = cKDTree(one.rim_mm).query(other.rim_mm)
    return there, back


def _compared(
    measured: Measured, compute: Callable[[Cavity, Cavity], float], *, is_length: bool
) -> Found:
    one, other = measured.cavity, measured.expert_cavity
    if one is None:
        return Found(None, (), NOBODY)
    if other is None:
        return Found(None, (), NO_EXPERT)
    if not len(one.voxels) or not len(other.voxels):
        return Found(None, (), "not enough data: both must have taken something")
    moments = tuple((edit.time_s, edit.time_s) for edit in measured.edits or ())
    # a rim is known to half a voxel
    sigma = one.spacing_mm / 2.0 if is_length else None
    return Found(compute(one, other), moments, sigma=sigma)


CAVITY = (
    Definition(
        "cavity distance to expert",
        PATIENT,
        "mm",
        partial(_compared, compute=mean_mm, is_length=True),
        is_slow=True,
    ),
    Definition(
        "Hausdorff cavity distance to expert",
        PATIENT,
        "mm",
        partial(_compared, compute=hausdorff_mm, is_length=True),
        is_slow=True,
    ),
    Definition(
        "cavity overlap with expert",
        PATIENT,
        "1",
        partial(_compared, compute=overlap, is_length=False),
        is_slow=True,
    ),
)
