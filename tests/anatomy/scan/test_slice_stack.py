"""Tilted and unevenly spaced stacks against fields that are known everywhere."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from anatomy.scan.slice_stack import SAME_PLACE_MM, Layout, SliceStack, straighten


def stack_of(
    seed: int, tilt_deg: float, steps: NDArray[np.float64]
) -> tuple[SliceStack, NDArray[np.float64]]:
    """Sample a linear field on slices; also give its gradient and constant."""
    rng = np.random.default_rng(seed)
    turn = Rotation.random(random_state=seed).as_matrix()
    row, column, normal = turn.T
    spacing = (rng.uniform(0.4, 1.0), rng.uniform(0.4, 1.0))
    table = normal + np.tan(np.radians(tilt_deg)) * column
    depth = np.concatenate([[0], np.cumsum(steps)])
    positions = rng.uniform(-50, 50, 3) + depth[:, None] * table
    field = np.append(rng.normal(size=3), rng.normal())
    rows, columns = 12, 9
    x, y = np.meshgrid(np.arange(columns) * spacing[0], np.arange(rows) * spacing[1])
    points = positions[:, None, None] + x[..., None] * row + y[..., None] * column
    pixels = points @ field[:3] + field[3]
    order = rng.permutation(len(positions))
    return SliceStack(pixels[order], positions[order], row, column, spacing), field


@given(
    seed=st.integers(0, 2**32 - 1),
    tilt=st.floats(-30, 30),
    steps=st.lists(st.floats(0.5, 3), min_size=2, max_size=8),
)
def test_linear_fields_are_kept_at_their_place(
    seed: int, tilt: float, steps: list[float]
) -> None:
    stack, field = stack_of(seed, tilt, np.array(steps))
    volume = straighten(stack.ordered(), background=np.nan)
    nz, ny, nx = volume.shape
    k, j, i = np.mgrid[:nz, :ny, :nx]
    voxel = np.stack([i, j, k, np.ones_like(i)], axis=-1)
    world = voxel @ volume.world_from_voxel.T
    expected = world[..., :3] @ field[:3] + field[3]
    values = np.asarray(volume.values, dtype=np.float64)
    seen = np.isfinite(values)
    # Half a pixel at the rim repeats the rim's value.
    inside = seen.copy()
    inside[:, [0, -1]] = False
    inside[:, :, [0, -1]] = False
    for axis in (1, 2):
        for by in (-1, 1):
            inside &= np.roll(seen, by, axis=axis)
    assert inside.any()
    error = np.abs(values - expected)[inside]
    # what is as good as regular is used as it is
    rounding = 2 * SAME_PLACE_MM * np.linalg.norm(field[:3])
    assert error.max() < rounding + 1e-4 * (1 + np.abs(expected).max())


def test_a_regular_stack_keeps_its_pixels() -> None:
    stack, _ = stack_of(3, 0.0, np.full(6, 1.25))
    ordered = stack.ordered()
    volume = straighten(ordered, background=0.0)
    assert np.array_equal(volume.values, ordered.pixels)
    assert volume.spacing_mm[2] == pytest.approx(1.25)
    assert volume.origin_mm == pytest.approx(ordered.positions_mm[0])
    assert Layout.of(ordered).is_regular


@given(tilt=st.floats(-35, 35))
def test_tilt_and_steps_are_measured(tilt: float) -> None:
    steps = np.array([4.0, 4.0, 1.1, 7.0, 7.0])
    stack, _ = stack_of(1, tilt, steps)
    layout = Layout.of(stack.ordered())
    assert layout.steps_mm == pytest.approx(steps)
    assert layout.tilt_deg == pytest.approx(abs(tilt), abs=1e-6)
    assert not layout.missing()


def test_lost_slices_are_counted_where_they_are() -> None:
    steps = np.full(10, 2.0)
    steps[4] = 6.0
    stack, _ = stack_of(1, 12.0, steps)
    assert Layout.of(stack.ordered()).missing() == [(4, 2)]


def test_two_slices_at_one_place_are_refused() -> None:
    stack, _ = stack_of(2, 5.0, np.array([1.0, 0.001, 1.0]))
    with pytest.raises(ValueError, match="more than one image per place"):
        stack.ordered()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"spacing_mm": (0.0, 1.0)}, "spacing"),
        ({"spacing_mm": (np.nan, 1.0)}, "spacing"),
        ({"row_direction": np.array([1.0, 0.2, 0.0])}, "right angles"),
        ({"positions_mm": np.full((3, 3), np.nan)}, "finite"),
        ({"positions_mm": np.zeros((2, 3))}, "one position"),
        (
            {"pixels": np.zeros((1, 4, 4)), "positions_mm": np.zeros((1, 3))},
            "one slice",
        ),
    ],
)
def test_what_is_no_stack_is_refused(change: dict[str, Any], message: str) -> None:
    good: dict[str, Any] = {
        "pixels": np.zeros((3, 4, 4)),
        "positions_mm": np.arange(9.0).reshape(3, 3),
        "row_direction": np.array([1.0, 0, 0]),
        "column_direction": np.array([0, 1.0, 0]),
        "spacing_mm": (1.0, 1.0),
    }
    with pytest.raises(ValueError, match=message):
        SliceStack(**(good | change))
