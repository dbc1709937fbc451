"""Where packets stand, and how far they leap, against the same in numpy."""

from typing import Any

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import njit
from numpy.typing import NDArray

from renderers.art.kernels.skip import SLOWEST, WITHIN, leap, per_voxel, place_samples
from renderers.lanes import f32, lanes, load, store

WIDTH = 8
EDGE = 40


@njit
def all_leaps(geometry: Any, far: Any, left: Any, top: Any, out: Any) -> None:
    ox, oy = load(geometry, 0, WIDTH), load(geometry, WIDTH, WIDTH)
    oz, sx = load(geometry, 2 * WIDTH, WIDTH), load(geometry, 3 * WIDTH, WIDTH)
    sy, sz = load(geometry, 4 * WIDTH, WIDTH), load(geometry, 5 * WIDTH, WIDTH)
    at = lanes(WIDTH)
    line, tops = (ox, oy, oz, sx, sy, sz), (top[0], top[1], top[2])
    ix, iy, iz, fx, fy, fz = place_samples(f32(at), line, tops)
    store(out, 0, ix)
    store(out, WIDTH, iy)
    store(out, 2 * WIDTH, iz)
    distance = load(far, 0, WIDTH)
    per = per_voxel(sx, sy, sz)
    ends = load(left, 0, WIDTH)
    jump = leap(distance > 0, distance, fx, fy, fz, per, ends)
    store(out, 3 * WIDTH, jump)


def leaps_from(
    place: NDArray[np.float32],
    step: NDArray[np.float32],
    far: NDArray[np.int32],
    left: NDArray[np.int32],
) -> NDArray[np.int32]:
    """Count samples, axis by axis, to the faces of the empty cubes around."""
    slow = np.where(step >= 0, np.maximum(step, SLOWEST), np.minimum(step, -SLOWEST))
    rate = np.float32(1) / slow
    fraction = place - np.floor(place)
    reach = far.astype(np.float32) - WITHIN
    out = ((np.float32(0.5) - fraction) * rate + reach * np.abs(rate)).min(axis=0)
    out = np.clip(out, 0, (left - 1).astype(np.float32)).astype(np.int32) + 1
    return np.where(far > 0, out, 0).astype(np.int32)


@given(st.integers(0, 2**32 - 1), st.sampled_from([0.0, 1e-9, 0.01, 0.5, 1.0]))
def test_leaps_are_those_of_numpy(seed: int, slow: float) -> None:
    random = np.random.default_rng(seed)
    origin = random.uniform(WIDTH, EDGE - WIDTH, (3, WIDTH))
    step = random.uniform(-0.9, 0.9, (3, WIDTH))
    step[random.integers(3)] *= slow
    geometry = np.concatenate([origin, step]).astype(np.float32)
    far = random.integers(0, 256, WIDTH).astype(np.int32)
    left = random.integers(1, 400, WIDTH).astype(np.int32)
    out = np.zeros((4, WIDTH), np.int32)
    all_leaps(geometry, far, left, np.full(3, EDGE, np.int32), out)
    place = geometry[:3] + np.arange(WIDTH, dtype=np.float32) * geometry[3:]
    np.testing.assert_array_equal(out[:3], place.astype(np.int32))
    np.testing.assert_array_equal(out[3], leaps_from(place, geometry[3:], far, left))
    assert (out[3] <= left).all()


@settings(max_examples=200)
@given(
    x=st.floats(0, 0.999),
    s=st.one_of(st.floats(-2, 2), st.sampled_from([0.0, -0.0, 1e-12, -1e-12, 1e-30])),
    cube=st.integers(0, 1000),
    distance=st.integers(1, 255),
    left=st.integers(1, 4000),
)
def test_a_leap_stays_in_empty_space_and_moves_on(
    x: float, s: float, cube: int, distance: int, left: int
) -> None:
    start, step = np.float32(cube + x), np.float32(s)
    geometry = np.zeros((6, WIDTH), np.float32)
    # lane 0 is at sample 0
    geometry[:3], geometry[0], geometry[3] = cube + 0.5, start, step
    out = np.zeros((4, WIDTH), np.int32)
    far, ends = (np.full(WIDTH, n, np.int32) for n in (distance, left))
    all_leaps(geometry, far, ends, np.full(3, 10_000, np.int32), out)
    jump = int(out[3, 0])
    assert 1 <= jump <= left
    last = start + np.float32(jump - 1) * step
    low, high = cube - distance + 1, cube + distance
    assert low <= last < high or jump == 1
    if jump < left:
        # Short by at most the precaution, two samples and rounding.
        short = last + np.float32(2) * step + np.sign(step) * np.float32(2.2e-3)
        assert not low + 1e-3 < short < high - 1e-3 or abs(step) < 1e-5


def test_samples_beyond_the_last_face_stand_in_the_last_cube() -> None:
    geometry = np.zeros((6, WIDTH), np.float32)
    geometry[0], geometry[3] = EDGE - 4, 1
    out = np.zeros((4, WIDTH), np.int32)
    ones = np.ones(WIDTH, np.int32)
    all_leaps(geometry, ones, ones, np.full(3, EDGE - 1, np.int32), out)
    expected = np.minimum(EDGE - 4 + np.arange(WIDTH), EDGE - 1)
    np.testing.assert_array_equal(out[0], expected)
