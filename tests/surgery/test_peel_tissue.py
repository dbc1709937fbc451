"""What is peeled changes no piece and no hole, of tissue or air, joined either way."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy import ndimage

from surgery.kernels.peel_tissue import peel

EVERY = np.ones((3, 3, 3))

Bits = NDArray[np.bool_]


def euler(voxels: Bits) -> int:
    """Count corners less edges plus faces less cubes of closed voxels."""
    total = 0
    for axes, sign in (
        ((0, 1, 2), 1),
        *(((a, b), -1) for a, b in ((0, 1), (0, 2), (1, 2))),
        *(((a,), 1) for a in range(3)),
        ((), -1),
    ):
        met = np.pad(voxels, 1)
        for axis in axes:
            n = met.shape[axis]
            met = met.take(range(n - 1), axis) | met.take(range(1, n), axis)
        total += sign * int(met.sum())
    return total


def shape_of(tissue: Bits) -> list[int]:
    """Return pieces by faces and by corners of both, and how they hang together."""
    found = []
    for voxels in (tissue, ~tissue):
        found += [int(ndimage.label(voxels, joined)[1]) for joined in (None, EVERY)]
        found.append(euler(voxels))
    return found


@given(st.integers(0, 2**32 - 1), st.sampled_from([0.3, 0.5, 0.8]))
def test_pieces_and_holes_stay(seed: int, share: float) -> None:
    rng = np.random.default_rng(seed)
    tissue = rng.random((7, 8, 9)) < share
    wanted = np.argwhere(tissue & (rng.random(tissue.shape) < 0.7))
    after = tissue.copy()
    peel(after, rng.permutation(wanted))
    assert not np.any(after & ~tissue)
    gone = tissue & ~after
    asked = np.zeros_like(tissue)
    asked[tuple(wanted.T)] = True
    assert not np.any(gone & ~asked)
    assert shape_of(after) == shape_of(tissue)


@pytest.mark.parametrize(
    ("kept", "left"), [("a voxel", 1), ("a ring", 16), ("a wall", 7 * 7 + 3 * 32)]
)
def test_what_may_go_goes(kept: str, left: int) -> None:
    """A ball to a voxel, a ring to a thin one, a wall to a layer within its rim."""
    tissue = np.zeros((9, 9, 9), bool)
    if kept == "a voxel":
        tissue[2:7, 2:7, 2:7] = True
    elif kept == "a ring":
        tissue[3:6, 1:8, 1:8] = True
        tissue[:, 3:6, 3:6] = False
    else:
        tissue[3:6] = True
    wanted = np.argwhere(tissue)
    depth = ndimage.distance_transform_edt(tissue)[tuple(wanted.T)]
    peel(tissue, wanted[np.argsort(depth, kind="stable")])
    # a ring may wind from layer to layer
    assert left <= tissue.sum() <= 1.2 * left
