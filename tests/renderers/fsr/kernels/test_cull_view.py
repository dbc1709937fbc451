from typing import Any

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from renderers.fsr.kernels.cull_view import ROOM, split_near, with_room
from renderers.fsr.splats.near_splats import (
    NEAR_KEYS,
    PARTS_REACH,
    SPLITS,
    WIDEST_SIGMA,
)

NEAR_MM = np.float32(6.0)
PER_MM = 30.0
LAST = np.float32(0.5**SPLITS)


def eye(at: Any) -> tuple[Any, ...]:
    """Give an eye, in steps of 1 mm, as `survey_spans` takes it."""
    matrix = np.eye(3, 4, dtype=np.float32)
    matrix[:, 3] = -np.asarray(at)
    low, scale = np.float32(0), np.float32(PER_MM)
    return np.zeros(3, np.float32), matrix, False, low, scale, NEAR_MM


@given(
    seed=st.integers(0, 10**6),
    count=st.integers(1, 60),
    sigma=st.floats(0.05, 0.5),
)
def test_near_parts_come_by_their_distance_whichever_splats_are_near(
    seed: int, count: int, sigma: float
) -> None:
    """Sixteen times as fine as all keys are, up to 7.5 mm."""
    rng = np.random.default_rng(seed)
    splats = rng.uniform(-6, 6, (count, 4)).astype(np.float32)
    paints = rng.uniform(0.1, 1, (count, 4)).astype(np.float32)
    at = rng.uniform(-1, 1, 3).astype(np.float32)
    distance = np.linalg.norm(splats[:, :3] - at, axis=1)
    near = np.flatnonzero(distance < NEAR_MM).astype(np.int32)
    some = near[rng.random(len(near)) < 0.5]
    split_at = np.float32(sigma / WIDEST_SIGMA), LAST
    places, _, keys, _ = split_near(near, (splats, paints), eye(at), split_at)
    few, _, few_keys, _ = split_near(some, (splats, paints), eye(at), split_at)
    depths = np.linalg.norm(places[:, :3] - at, axis=1)
    assert np.all(depths < NEAR_MM * PARTS_REACH)
    assert np.all(np.abs(keys + 0.5 - depths * PER_MM * 16) <= 0.51)
    assert np.all(keys < NEAR_KEYS)
    found = {tuple(p): key for p, key in zip(places.tolist(), keys, strict=True)}
    assert all(
        found[tuple(p)] == key for p, key in zip(few.tolist(), few_keys, strict=True)
    )


def test_room_for_near_splats_grows_and_keeps_what_is_there() -> None:
    near = np.arange(ROOM, dtype=np.int32)
    spans = np.array([[7, 0, ROOM], [8, ROOM, ROOM + 5]], np.int32)
    assert len(with_room(near, 0, spans[:1])) == ROOM
    more = with_room(near, 100, spans)
    assert len(more) >= 100 + ROOM + 5
    np.testing.assert_array_equal(more[:100], near[:100])
