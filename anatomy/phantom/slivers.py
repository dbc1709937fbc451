"""Isolated specks of air, which wall cells leave in their corners."""

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

LARGEST_SLIVER_ML = 0.08
"""Less than the smallest ethmoid cell, more than a pocket of a meatus that the
unevenness of its walls has closed."""


def remove_slivers(
    air: NDArray[np.float32], part: NDArray[np.uint8], spacing_mm: float
) -> int:
    """Turn air that is cut off from the nose into tissue, in place; count the pieces.

    The largest component is the airway. Pieces of `LARGEST_SLIVER_ML` and more stay:
    they are sinuses that lost their drainage, which a caller must see. Pieces that
    touch the volume's border stay, too: outside they may be joined to the nose.
    """
    pieces, count = ndimage.label(air < 0)
    if count <= 1:
        return 0
    sizes = np.bincount(pieces.ravel())
    sizes[0] = 0
    limit = LARGEST_SLIVER_ML * 1000 / spacing_mm**3
    small = sizes < limit
    small[0] = False
    small[np.argmax(sizes)] = False
    for axis in range(3):
        ends = np.take(pieces, [0, -1], axis=axis)
        small[np.unique(ends)] = False
    specks = small[pieces]
    air[specks] = -air[specks]
    return int(np.count_nonzero(small))
