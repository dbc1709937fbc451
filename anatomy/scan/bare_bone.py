"""Bone without mucosa: a skull, or a cast of one, in a scan."""

import math

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from renderers.scene.volume import Volume

BONE_HU = 250.0
"""Above muscle and mucosa with contrast agent."""

DEPTHS_MM = (1.0, 0.5)
"""Below the surface, where voxels hold no air any more; the smaller one where walls
are too thin for the other."""

FEWEST_VOXELS = 1000

BARE_SHARE = 0.6
"""Of what lies so deep; of living heads a third is bone, of skulls nine tenths."""

REACH_MM = 2.0
"""From the surface to where its bone shows in full."""


def bare_bone(ct: Volume, distance: Volume) -> NDArray[np.bool_]:
    """Mark the voxels whose surface is bare bone, ``(nz, ny, nx)``.

    ct: CT numbers on cubic voxels. distance: signed mm to the air surface, negative in
    air, on the same grid. None is marked in a head that has its soft tissue.
    """
    values = np.asarray(ct.values)
    none = np.zeros(values.shape, np.bool_)
    for depth in DEPTHS_MM:
        deep = values[np.asarray(distance.values) > depth]
        if len(deep) >= FEWEST_VOXELS:
            break
    if not len(deep) or np.mean(deep > BONE_HU) < BARE_SHARE:
        return none
    size = 2 * math.ceil(REACH_MM / float(ct.spacing_mm[0])) + 1
    nearest = ndimage.maximum_filter(values, size)
    marked: NDArray[np.bool_] = nearest > BONE_HU
    return marked
