import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from renderers.art.cells.cells import CellGrid
from renderers.art.kernels.build_bricks import build_brick, set_up_rays
from renderers.reference import box_interval, sobel_gradient
from renderers.scene import Volume

SPACING = np.array([0.4, 0.6, 0.9])


@settings(max_examples=10)
@given(shape=st.tuples(*[st.integers(2, 21)] * 3), seed=st.integers(0, 99))
def test_a_brick_holds_values_and_sobel_gradients(
    shape: tuple[int, int, int], seed: int
) -> None:
    values = np.random.default_rng(seed).normal(size=shape).astype(np.float32)
    volume = Volume(values, SPACING, np.zeros(3))
    gradient = sobel_gradient(volume)
    grid = CellGrid(shape)
    for cell in range(grid.cells):
        z, y, x = grid.start(cell)
        samples = np.zeros(9**3 * 4, np.float32)
        build_brick(
            np.asarray(grid.block(values, cell), np.float32),
            np.array([x, y, z], np.int32),
            np.array(shape[::-1], np.int32),
            (1 / SPACING).astype(np.float32),
            samples,
        )
        brick = samples.reshape(9, 9, 9, 4)
        inside = tuple(
            slice(s, min(s + 9, n)) for s, n in zip((z, y, x), shape, strict=True)
        )
        n0, n1, n2 = (s.stop - s.start for s in inside)
        assert np.array_equal(brick[:n0, :n1, :n2, 0], values[inside])
        assert brick[:n0, :n1, :n2, 1:] == pytest.approx(gradient[inside], abs=2e-5)


@settings(max_examples=60)
@given(
    eye=st.tuples(*[st.floats(-30, 30)] * 3),
    angle=st.floats(0, 2 * math.pi),
    rise=st.floats(-1, 1),
    step=st.floats(0.01, 5),
    at_ends=st.booleans(),
)
def test_segments_tile_the_interval_exactly(
    eye: tuple[float, float, float],
    angle: float,
    rise: float,
    step: float,
    at_ends: bool,
) -> None:
    rng = np.random.default_rng(0)
    volume = Volume(
        np.zeros((11, 12, 13), np.int16),
        SPACING,
        np.array([-3.0, -3, -5]),
        np.linalg.qr(rng.normal(size=(3, 3)))[0],
    )
    flat = math.sqrt(1 - rise**2)
    table = np.array(
        [[flat * math.cos(angle), flat * math.sin(angle), rise]], np.float32
    )
    frame = np.concatenate([[eye], np.eye(3)])
    geometry, count = np.zeros((1, 8), np.float32), np.zeros(1, np.int32)
    top = np.array([12.0, 11, 10])
    set_up_rays(
        table, np.full(1, np.inf, np.float32), 0, frame, False,
        np.array(volume.voxel_from_world), top, step, at_ends,
        geometry, count,
    )  # fmt: skip
    direction = table / np.linalg.norm(table.astype(float))
    near, far = box_interval(volume, np.array([eye]), direction)
    length = float(far[0] - near[0])
    if length <= 1e-9:
        assert count[0] <= 2
        return
    n = int(count[0]) - at_ends
    h = float(geometry[0, 6])
    assert n == max(1, math.ceil(length / step)) or abs(length / step % 1) < 1e-9
    assert n * h == pytest.approx(length, rel=1e-6)
    assert h <= step * (1 + 1e-6)
    first = near[0] + (0 if at_ends else 0.5) * h
    assert geometry[0, 7] == pytest.approx(first, rel=1e-6, abs=1e-6)
    for i in (0, count[0] - 1):
        voxel = geometry[0, :3] + np.float32(i) * geometry[0, 3:6]
        assert np.all(voxel > -1e-4)
        assert np.all(voxel < top + 1e-4)
