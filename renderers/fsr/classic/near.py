"""Splats too near for one footprint, replaced by eight of half the size.

The projection of a footprint is made straight at its centre. That fails from an
angular sigma of about 0.1 on: at 0.2 the footprint is already a fifth too narrow. The
eight lie on a lattice of half the spacing and share the splat's extinction and
volume, so that what it hides stays the same.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderers.fsr.classic.splitting.kernels import split_splats
from renderers.fsr.classic.view import View

WIDEST_SIGMA = 0.1
"""Angular sigma, in radians, above which a splat is split."""

LAST_SIGMA = 0.5
"""And above which one is left out that has been split often enough."""

SPLITS = 3
"""A splat of 0.3 mm sigma reaches 0.04 mm and is drawn from 0.08 mm on."""


@dataclass(frozen=True, slots=True)
class NearSplats:
    """Hold the splats near an eye, nearest first.

    places, paints: see `PaintedSet`; smaller ones in place of those too near. split:
    how many were replaced.
    """

    places: NDArray[np.float32]
    paints: NDArray[np.float32]
    split: int


def split_near(
    index: NDArray[np.int32],
    painted_places: NDArray[np.float32],
    paints: NDArray[np.float32],
    view: View,
    sigma_mm: float,
) -> NearSplats:
    """Split splats of `sigma_mm` until none is too near, `SPLITS` times at most.

    index: which of those of a set (see `PaintedSet`). Parts lie at most half a voxel's
    diagonal from their splat.
    """
    if len(index) == 0:
        none = np.empty((0, 4), np.float32)
        return NearSplats(none, none, 0)
    places, colours, split, order = split_splats(
        index,
        painted_places,
        paints,
        view.base,
        view.matrix,
        view.is_flat,
        np.float32(sigma_mm / WIDEST_SIGMA),
        np.float32(0.5**SPLITS),
    )
    order.sort()
    numbers = order & 0xFFFFFFFF
    return NearSplats(places[numbers], colours[numbers], split)
