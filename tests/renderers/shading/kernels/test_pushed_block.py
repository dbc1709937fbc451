"""Points of a block are brought to rest by the offsets there, and shown again."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from numpy.typing import NDArray

from renderers.scene import Volume
from renderers.shading.kernels import pixel_block as b
from renderers.shading.kernels.pushed_block import (
    PushedField,
    bring_to_rest,
    show_again,
    voxel_at_rest,
)

SHAPE = (9, 10, 11)
SPACING = np.array([0.5, 0.6, 0.7])
TURN = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])


def pushed_field(
    seed: int, box: tuple[float, ...]
) -> tuple[PushedField, tuple[Volume, ...]]:
    rng = np.random.default_rng(seed)
    parts = []
    for _ in range(3):
        values = np.zeros(SHAPE, np.float32)
        values[3:6, 3:7, 3:8] = rng.uniform(-0.6, 0.6, (3, 4, 5))
        parts.append(Volume(values, SPACING, np.zeros(3), TURN, 0.0))
    arrays = [part.values for part in parts]
    field = PushedField(arrays[0], arrays[1], arrays[2], np.array(box, np.float32))
    return field, tuple(parts)


def block_at(
    voxels: NDArray[np.float64], places: NDArray[np.float64]
) -> NDArray[np.float32]:
    w = np.zeros(b.SLOTS, np.float32)
    w[b.COVER : b.COVER + b.N] = 1
    for axis in range(3):
        w[b.PX + axis * b.N : b.PX + (axis + 1) * b.N] = places[:, axis]
        w[b.UX + axis * b.N : b.UX + (axis + 1) * b.N] = voxels[:, axis]
    return w


def triple(w: NDArray[np.float32], slot: int) -> NDArray[np.float32]:
    return np.stack([w[slot + a * b.N : slot + (a + 1) * b.N] for a in range(3)], -1)


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=20)
def test_points_move_by_the_offsets_where_they_are_shown(seed: int) -> None:
    field, parts = pushed_field(seed, (2, 2, 2, 8, 8, 7))
    rng = np.random.default_rng(seed)
    voxels = rng.uniform(0, np.array(SHAPE[::-1]) - 1.01, (b.N, 3))
    voxels[0] = 4.5
    m = parts[0].world_from_voxel
    places = voxels @ m[:3, :3].T + m[:3, 3]
    w = block_at(voxels, places)
    before = w.copy()
    turn = np.ascontiguousarray(parts[0].voxel_from_world[:3, :3], np.float32)
    assert bring_to_rest(w, field, turn)
    offsets = np.stack([part.sample(places) for part in parts], axis=-1)
    assert_allclose(triple(w, b.PX), places + offsets, atol=1e-5)
    moved = triple(w, b.UX) @ m[:3, :3].T + m[:3, 3]
    assert_allclose(moved, places + offsets, atol=1e-5)
    still = ~offsets.any(axis=1)
    assert_array_equal(triple(w, b.PX)[still], triple(before, b.PX)[still])
    assert_array_equal(triple(w, b.SHOWN_UX), triple(before, b.UX))
    show_again(w)
    assert_array_equal(w[: b.SHOWN], before[: b.SHOWN])


def test_a_voxel_is_taken_where_it_lies_at_rest() -> None:
    field, parts = pushed_field(3, (2, 2, 2, 8, 8, 7))
    turn = np.ascontiguousarray(parts[0].voxel_from_world[:3, :3], np.float32)
    m = parts[0].world_from_voxel
    for voxel in np.argwhere(field.x != 0)[:, ::-1]:
        i, j, k = voxel.tolist()
        off = np.array([part.values[k, j, i] for part in parts])
        place = m[:3, :3] @ voxel + off
        expected = np.rint(parts[0].voxel_from_world[:3, :3] @ place)
        assert voxel_at_rest(field, turn, i, j, k) == tuple(expected)
