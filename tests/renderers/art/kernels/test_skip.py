"""Packets stand and leap as single rays do, bit by bit."""

from typing import Any

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numba import njit

from renderers.art.kernels.march_scalar import leap_out
from renderers.art.kernels.march_scalar import per_voxel as per_voxel_of_one
from renderers.art.kernels.skip import leap, per_voxel, stand
from renderers.lanes import f32, lanes, load, store

WIDTH = 8
EDGE = 40


@njit
def all_leaps(geometry: Any, far: Any, left: Any, top: Any, out: Any) -> None:
    ox, oy = load(geometry, 0, WIDTH), load(geometry, WIDTH, WIDTH)
    oz, sx = load(geometry, 2 * WIDTH, WIDTH), load(geometry, 3 * WIDTH, WIDTH)
    sy, sz = load(geometry, 4 * WIDTH, WIDTH), load(geometry, 5 * WIDTH, WIDTH)
    at = lanes(WIDTH)
    ix, iy, iz, fx, fy, fz = stand(
        f32(at), ox, oy, oz, sx, sy, sz, top[0], top[1], top[2]
    )
    store(out, 0, ix)
    store(out, WIDTH, iy)
    store(out, 2 * WIDTH, iz)
    distance = load(far, 0, WIDTH)
    px, py, pz = per_voxel(sx), per_voxel(sy), per_voxel(sz)
    ends = load(left, 0, WIDTH)
    jump = leap(distance > 0, distance, fx, fy, fz, px, py, pz, ends)
    store(out, 3 * WIDTH, jump)


@given(st.integers(0, 2**32 - 1), st.sampled_from([0.0, 1e-9, 0.01, 0.5, 1.0]))
def test_leaps_are_those_of_the_scalar_march(seed: int, slow: float) -> None:
    random = np.random.default_rng(seed)
    origin = random.uniform(WIDTH, EDGE - WIDTH, (3, WIDTH))
    step = random.uniform(-0.9, 0.9, (3, WIDTH))
    step[random.integers(3)] *= slow
    geometry = np.concatenate([origin, step]).astype(np.float32)
    far = random.integers(0, 256, WIDTH).astype(np.int32)
    left = random.integers(1, 400, WIDTH).astype(np.int32)
    top = np.full(3, EDGE, np.int32)
    out = np.zeros((4, WIDTH), np.int32)
    all_leaps(geometry, far, left, top, out)
    for k in range(WIDTH):
        o, s = geometry[:3, k], geometry[3:, k]
        place = o + np.float32(k) * s
        cube = place.astype(np.int32)
        assert out[:3, k].tolist() == cube.tolist()
        rates = [per_voxel_of_one(rate) for rate in s]
        x, y, z = place
        px, py, pz = rates
        ix, iy, iz = cube.tolist()
        ends = int(far[k]), int(left[k])
        jump = leap_out(x, y, z, px, py, pz, ix, iy, iz, *ends)
        assert out[3, k] == (jump if far[k] > 0 else 0)
        assert out[3, k] <= left[k]


def test_samples_beyond_the_last_face_stand_in_the_last_cube() -> None:
    geometry = np.zeros((6, WIDTH), np.float32)
    geometry[0], geometry[3] = EDGE - 4, 1
    out = np.zeros((4, WIDTH), np.int32)
    ones = np.ones(WIDTH, np.int32)
    all_leaps(geometry, ones, ones, np.full(3, EDGE - 1, np.int32), out)
    expected = np.minimum(EDGE - 4 + np.arange(WIDTH), EDGE - 1)
    np.testing.assert_array_equal(out[0], expected)
