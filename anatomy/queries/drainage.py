"""Which sinuses drain into the nose, found in the volumes."""

import numpy as np
from scipy import ndimage

from anatomy.phantom.air import LARGEST_SLIVER_ML
from anatomy.phantom.phantom import Phantom
from anatomy.tissue import Label, Side

_AIR = {
    "maxillary": Label.MAXILLARY_AIR,
    "anterior ethmoid": Label.ANTERIOR_ETHMOID_AIR,
    "posterior ethmoid": Label.POSTERIOR_ETHMOID_AIR,
    "sphenoid": Label.SPHENOID_AIR,
    "frontal": Label.FRONTAL_AIR,
    "variant cell": Label.VARIANT_CELL_AIR,
}


def trapped_sinuses(phantom: Phantom) -> tuple[str, ...]:
    """Name sinuses that hold air without a way to the nose, such as ``frontal, left``.

    Their ostium is blocked, or they drain into a neighbour that disease has filled.
    Pockets below `LARGEST_SLIVER_ML` and air that reaches the volume's border do not
    count.
    """
    pieces, count = ndimage.label(phantom.distance.values < 0)
    if count <= 1:
        return ()
    sizes = np.bincount(pieces.ravel(), minlength=count + 1)
    sizes[0] = 0
    is_shut = sizes >= LARGEST_SLIVER_ML * 1000 / phantom.spacing_mm**3
    is_shut[np.argmax(sizes)] = False
    for axis in range(3):
        is_shut[np.unique(np.take(pieces, [0, -1], axis=axis))] = False
    if not is_shut.any():
        return ()
    shut = is_shut[pieces]
    labels, sides = phantom.labels.values[shut], phantom.sides.values[shut]
    return tuple(
        f"{name}, {side.name.lower()}"
        for name, label in _AIR.items()
        for side in (Side.RIGHT, Side.LEFT)
        if np.any((labels == label) & (sides == side))
    )
