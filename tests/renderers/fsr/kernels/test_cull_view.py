import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from renderers.fsr.kernels.project_splats import Splats
from renderers.fsr.kernels.subdivide import (
    NEAR_KEYS,
    PARTS_REACH,
    SPLITS,
    WIDEST_SIGMA,
    subdivide_near,
)
from tests.renderers.fsr.splat_scenes import view_from

NEAR_MM = np.float32(6.0)
PER_MM = 30.0
LAST = np.float32(0.5**SPLITS)


@given(seed=st.integers(0, 10**6), count=st.integers(1, 60), sigma=st.floats(0.05, 0.5))
def test_near_parts_come_by_their_distance_whichever_splats_are_near(
    seed: int, count: int, sigma: float
) -> None:
    """Sixteen times as fine as all keys are, up to 7.5 mm."""
    rng = np.random.default_rng(seed)
    splats = rng.uniform(-6, 6, (count, 4)).astype(np.float32)
    colors = rng.uniform(0.1, 1, (count, 4)).astype(np.float32)
    at = rng.uniform(-1, 1, 3).astype(np.float32)
    distance = np.linalg.norm(splats[:, :3] - at, axis=1)
    near = np.flatnonzero(distance < NEAR_MM).astype(np.int32)
    some = near[rng.random(len(near)) < 0.5]
    view = view_from(at, keys_per_mm=PER_MM, near_mm=float(NEAR_MM))
    both, nearest = Splats(splats, colors), np.float32(sigma / WIDEST_SIGMA)
    parts, keys, _ = subdivide_near(near, both, view, nearest, LAST)
    fewer, few_keys, _ = subdivide_near(some, both, view, nearest, LAST)
    places, few = parts.places, fewer.places
    depths = np.linalg.norm(places[:, :3] - at, axis=1)
    assert np.all(depths < NEAR_MM * PARTS_REACH)
    assert np.all(np.abs(keys + 0.5 - depths * PER_MM * 16) <= 0.51)
    assert np.all(keys < NEAR_KEYS)
    found = {tuple(p): key for p, key in zip(places.tolist(), keys, strict=True)}
    assert all(
        found[tuple(p)] == key for p, key in zip(few.tolist(), few_keys, strict=True)
    )
