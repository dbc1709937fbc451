"""The compiled search along a shaft against plain interpolation."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from renderers.scene import Volume
from renderers.scene.kernels.least_along import least_along


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
