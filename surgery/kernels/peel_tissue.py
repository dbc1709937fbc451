"""Take tissue away voxel by voxel; nothing comes loose and nothing is broken through.

A voxel is simple where taking it away makes neither a piece nor a hole more or less, of
tissue or of air (Bertrand and Malandain, Pattern Recognition Letters 15, 1994). Which
neighbours count as joined is a choice: here it must hold for both, faces alone and
corners, too, since a surface between voxels may be drawn either way.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

CENTRE = 13
"""Of 27 voxels, x fastest."""


def _neighbours(steps: tuple[int, ...]) -> NDArray[np.int64]:
    """Return which of 27 voxels touch each one, as bits; steps: along how many axes."""
    masks = np.zeros(27, np.int64)
    places = [(n // 9, n // 3 % 3, n % 3) for n in range(27)]
    for n, here in enumerate(places):
        for m, there in enumerate(places):
            away = [abs(a - b) for a, b in zip(here, there, strict=True)]
            if max(away) == 1 and sum(away) in steps:
                masks[n] |= 1 << m
    return masks


_FACES = _neighbours((1,))
_CORNERS = _neighbours((1, 2, 3))
_NEAR = int(_CORNERS[CENTRE])
_BESIDE = int(_FACES[CENTRE])
_EDGES = int(_neighbours((1, 2))[CENTRE])


@njit(cache=True, nogil=True)
def count_pieces(cells: int, joined: NDArray[np.int64], among: int) -> int:
    """Count the pieces of some of 27 cells, given as bits, that reach one of others."""
    pieces = 0
    while cells & among:
        first = cells & among
        piece = first & -first
        grown = 0 * piece
        while piece != grown:
            grown = piece
            for n in range(27):
                if grown >> n & 1:
                    piece |= joined[n] & cells
        cells &= ~piece
        pieces += 1
    return pieces


@njit(cache=True, nogil=True)
def is_simple(tissue: int) -> bool:
    """Tell whether the centre of 27 voxels, tissue as bits, is simple."""
    flesh, air = tissue & _NEAR, ~tissue & _NEAR
    return (
        count_pieces(flesh, _CORNERS, _NEAR) == 1
        and count_pieces(air & _EDGES, _FACES, _BESIDE) == 1
        and count_pieces(air, _CORNERS, _NEAR) == 1
        and count_pieces(flesh & _EDGES, _FACES, _BESIDE) == 1
    )


@njit(cache=True, nogil=True)
def peel(tissue: NDArray[np.bool_], places: NDArray[np.int64]) -> None:
    """Make air of voxels that are simple, again and again until none is.

    tissue: ``(nz, ny, nx)``, changed in place. places: ``(n, 3)`` of voxels (k, j, i)
    that shall go, in that order; those on the array's faces stay.
    """
    nz, ny, nx = tissue.shape
    changed = True
    while changed:
        changed = False
        for n in range(len(places)):
            z, y, x = places[n]
            inner = 0 < z < nz - 1 and 0 < y < ny - 1 and 0 < x < nx - 1
            if not (inner and tissue[z, y, x]):
                continue
            bits = 0
            for c in range(27):
                if tissue[z + c // 9 - 1, y + c // 3 % 3 - 1, x + c % 3 - 1]:
                    bits |= 1 << c
            if is_simple(bits):
                tissue[z, y, x] = False
                changed = True
