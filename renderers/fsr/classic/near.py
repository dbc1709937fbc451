"""Splats too near for one footprint, replaced by eight of half the size.

The projection of a footprint is made straight at its centre. That fails from an
angular sigma of about 0.1 on: at 0.2 the footprint is already a fifth too narrow. The
eight lie on a lattice of half the spacing and share the splat's extinction and
volume, so that what it hides stays the same.
"""

import itertools

import numpy as np
from numpy.typing import NDArray

WIDEST_SIGMA = 0.1
"""Angular sigma, in radians, above which a splat is split."""

LAST_SIGMA = 0.5
"""And above which one is left out that has been split often enough."""

SPLITS = 3
"""A splat of 0.3 mm sigma reaches 0.04 mm and is drawn from 0.08 mm on."""

_CORNERS = np.array(list(itertools.product((-0.25, 0.25), repeat=3)), np.float32)


def split(places: NDArray[np.float32], size: float) -> NDArray[np.float32]:
    """Give the eight parts of each splat: ``(8 n, 4)``, far from sorted.

    places: ``(n, 4)`` grid place and optical mass (extinction times volume). size: of
    the splats, in grid steps.
    """
    parts = np.repeat(places, 8, axis=0)
    parts[:, :3] += np.tile(_CORNERS * np.float32(size), (len(places), 1))
    parts[:, 3] /= 8
    return parts
