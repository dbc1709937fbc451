"""The compiled search along a shaft against plain interpolation."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from renderers.scene import Volume
from renderers.scene.kernels.least_along import least_along, least_along_each


@given(seed=st.integers(0, 2**32 - 1))
def test_it_finds_what_interpolation_point_by_point_finds(seed: int) -> None:
    rng = np.random.default_rng(seed)
    shape = tuple(rng.integers(2, 9, 3))
    values = rng.normal(size=shape).astype(np.float32)
    field = Volume(values, np.ones(3), np.zeros(3), background=-50.0)
    start = rng.uniform(-4, 10, 3)
    step = rng.normal(size=3) * 10 ** rng.uniform(-2, 0.5)
    count = int(rng.integers(1, 60))
    points = start + np.arange(count)[:, None] * step
    air = -field.sample(points)
    where, least = least_along(field.values, -1.0, start, step, count, 50.0)
    assert abs(least - air.min()) < 1e-6
    assert abs(air[where] - air.min()) < 1e-6
    # to the bit: the same search in the field with the other sign
    other = least_along(-field.values, 1.0, start, step, count, 50.0)
    assert other == (where, least)


def test_the_last_layer_of_the_grid_still_counts() -> None:
    values = np.zeros((3, 3, 3), np.float32)
    values[2, 2, 2] = 7
    field = Volume(values, np.ones(3), np.zeros(3), background=0.0)
    where, least = least_along(
        field.values, -1.0, np.array([0.0, 2.0, 2.0]), np.array([1.0, 0.0, 0.0]), 4, 9.0
    )
    assert (where, least) == (2, -7.0)


@given(seed=st.integers(0, 2**32 - 1))
def test_many_lines_are_each_line_to_the_bit(seed: int) -> None:
    """Also where points are left out that cannot be the least at a slope of 1."""
    rng = np.random.default_rng(seed)
    shape = tuple(rng.integers(2, 12, 3))
    places = rng.uniform(-3, 12, (3, 3))
    voxels = np.indices(shape)[::-1].reshape(3, -1).T[:, None]
    away = np.linalg.norm(voxels - places, axis=2).min(axis=1) - 1.0
    values = away.reshape(shape).astype(np.float32)
    starts = rng.uniform(-4, 12, (5, 3))
    steps = rng.normal(size=(5, 3)) * 10 ** rng.uniform(-2, 0.0)
    fall = 3**0.5 * float(np.linalg.norm(steps, axis=1).max()) + 1e-5
    each = [
        least_along(values, 1.0, a, b, 60, 50.0)
        for a, b in zip(starts, steps, strict=True)
    ]
    everywhere = np.array([[-np.inf] * 3, [np.inf] * 3])
    for falling in (fall, np.inf):
        where, least = least_along_each(
            values, 1.0, starts, steps, 60, 50.0, falling, (everywhere, 0.0)
        )
        assert [(int(a), float(b)) for a, b in zip(where, least, strict=True)] == each


@given(seed=st.integers(0, 2**32 - 1))
def test_a_box_of_what_is_not_far_changes_nothing(seed: int) -> None:
    """Also for lines that miss it, that stand still and that run along its faces."""
    rng = np.random.default_rng(seed)
    shape = tuple(rng.integers(6, 14, 3))
    voxels = np.indices(shape)[::-1].reshape(3, -1).T
    places = rng.uniform(2, 10, 3)
    places = np.rint(np.minimum(places, np.array(shape[::-1]) - 2.0))
    away = np.minimum(np.linalg.norm(voxels - places, axis=1), 2.5).reshape(shape)
    values = np.rint(away * 100).astype(np.int16)
    near = np.argwhere(values != 250)[:, ::-1]
    box = np.array([near.min(axis=0) - 1.0, near.max(axis=0) + 1.0])
    starts = rng.integers(-3, 14, (6, 3)) + rng.choice([0.0, 0.37], (6, 3))
    steps = rng.choice([0.0, 0.25, -0.25, 0.1], (6, 3))
    far = float(rng.choice([250.0, 1000.0]))
    each = [
        least_along(values, 1.0, a, b, 70, far)
        for a, b in zip(starts, steps, strict=True)
    ]
    fall = 100 * 3**0.5 * 0.25 * 3**0.5 + 2.0
    for falling in (fall, np.inf):
        where, least = least_along_each(
            values, 1.0, starts, steps, 70, far, falling, (box, 250.0)
        )
        # weights of eight equal corners may not sum up to 1
        np.testing.assert_allclose(least, [value for _, value in each], rtol=1e-12)
        for line, n in enumerate(where):
            at = starts[line] + n * steps[line]
            _, there = least_along(values, 1.0, at, at, 1, far)
            assert abs(there - least[line]) < 1e-9
