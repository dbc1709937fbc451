"""Splats too near for one footprint, replaced by eight of half the size.

The projection of a footprint is made straight at its centre. That fails from an
angular sigma of about 0.1 on: at 0.2 the footprint is already a fifth too narrow. The
eight lie on a lattice of half the spacing and share the splat's extinction and
volume, so that what it hides stays the same.
"""

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderers.fsr.classic.shells.kernels import depths_of_places
from renderers.fsr.classic.view import View

WIDEST_SIGMA = 0.1
"""Angular sigma, in radians, above which a splat is split."""

LAST_SIGMA = 0.5
"""And above which one is left out that has been split often enough."""

SPLITS = 3
"""A splat of 0.3 mm sigma reaches 0.04 mm and is drawn from 0.08 mm on."""

_CORNERS = np.array(list(itertools.product((-0.25, 0.25), repeat=3)), np.float32)


@dataclass(frozen=True, slots=True)
class NearSplats:
    """Hold the splats near an eye, nearest first.

    places, paints: see `PaintedSet`; smaller ones in place of those too near. split:
    how many were replaced.
    """

    places: NDArray[np.float32]
    paints: NDArray[np.float32]
    split: int


def split(places: NDArray[np.float32], size: float) -> NDArray[np.float32]:
    """Give the eight parts of each splat: ``(8 n, 4)``, far from sorted.

    places: ``(n, 4)`` grid place and optical mass (extinction times volume). size: of
    the splats, in grid steps.
    """
    parts = np.repeat(places, 8, axis=0)
    parts[:, :3] += np.tile(_CORNERS * np.float32(size), (len(places), 1))
    parts[:, 3] /= 8
    return parts


def split_near(
    places: NDArray[np.float32],
    paints: NDArray[np.float32],
    view: View,
    sigma_mm: float,
) -> NearSplats:
    """Split splats of `sigma_mm` until none is too near, `SPLITS` times at most.

    Parts lie at most half a voxel's diagonal from their splat.
    """
    done: list[tuple[NDArray[np.float32], ...]] = []
    size, count = 1.0, 0
    for turn in range(SPLITS + 1):
        depths = np.empty(len(places), np.float32)
        depths_of_places(places, view.base, view.matrix, view.is_flat, depths)
        near = depths < size * sigma_mm / WIDEST_SIGMA
        if turn == SPLITS or view.is_flat:
            near[:] = False
        done.append((places[~near], paints[~near], depths[~near]))
        if not near.any():
            break
        count += int(near.sum())
        places = split(places[near], size)
        paints = np.repeat(paints[near], 8, axis=0)
        paints[:, 3] /= 2
        size /= 2
    all_places, all_paints, depth = (
        np.concatenate(parts) for parts in zip(*done, strict=True)
    )
    order = np.argsort(depth, kind="stable")
    return NearSplats(all_places[order], all_paints[order], count)
