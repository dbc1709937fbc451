"""Tilted and unevenly spaced stacks against fields that are known everywhere."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from anatomy.scan.slice_stack import (
    SAME_PLACE_MM,
    SliceStack,
    StackLayout,
    lost_slices,
    straighten,
)


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
    assert StackLayout.of(ordered).is_regular


@given(tilt=st.floats(-35, 35))
def test_tilt_and_steps_are_measured(tilt: float) -> None:
    steps = np.array([4.0, 4.0, 1.1, 7.0, 7.0])
    stack, _ = stack_of(1, tilt, steps)
    layout = StackLayout.of(stack.ordered())
    assert layout.steps_mm == pytest.approx(steps)
    assert layout.tilt_deg == pytest.approx(abs(tilt), abs=1e-6)
    assert not layout.missing()


def test_lost_slices_are_counted_where_they_are() -> None:
    steps = np.full(10, 2.0)
    steps[4] = 6.0
    stack, _ = stack_of(1, 12.0, steps)
    assert StackLayout.of(stack.ordered()).missing() == [(4, 2)]


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


def without(*lost: int, count: int = 60, step: float = 1.25) -> np.ndarray:
    """Give the steps of a stack without some of its slices."""
    kept = np.setdiff1d(np.arange(count), lost)
    # as scanners write it: rounded
    return np.diff(np.round(kept * step + 3.3, 2))


LOST = {
    "one": (30,),
    "two with one between": (30, 32),
    "fifteen alternating": tuple(range(10, 40, 2)),
    "a run and one": (40, 41, 42, 43, 44, 46),
    "one after the other's end": (40, 41, 42, 43, 44, 46, 47, 49),
    "nearly every second one": tuple(n for n in range(1, 59, 2) if n not in (19, 43)),
    "every second one but the last": tuple(range(1, 57, 2)),
    "every second one from the middle on": tuple(range(30, 59, 2)),
    "two of three": tuple(n for n in range(1, 50) if n % 3),
    "thirty in a row": tuple(range(15, 45)),
    "near both ends": (1, 58),
}


@pytest.mark.parametrize("row", LOST)
@pytest.mark.parametrize("thickness", [None, 1.25, 2.5])
def test_every_lost_slice_is_counted(row: str, thickness: float | None) -> None:
    lost = LOST[row]
    steps = without(*lost)
    thick = None if thickness is None else np.full(len(steps) + 1, thickness)
    found = lost_slices(steps, thick)
    kept = np.setdiff1d(np.arange(60), lost)
    told = [int(kept[place]) + 1 + n for place, many in found for n in range(many)]
    assert told == sorted(lost)


@given(
    lost=st.sets(st.integers(1, 48), max_size=30),
    step=st.sampled_from([0.5, 0.625, 1.0, 3.0]),
)
def test_any_slices_that_leave_two_neighbours(lost: set[int], step: float) -> None:
    lost -= {1, 2, 3}  # one pair of neighbours tells what a step is
    found = lost_slices(without(*lost, count=50, step=step))
    assert sum(many for _, many in found) == len(lost)


def test_the_thickness_tells_where_no_neighbours_are_left() -> None:
    steps = np.array([2.0, 3.0, 2.0, 3.0, 2.0])
    assert lost_slices(steps) == []
    assert sum(n for _, n in lost_slices(steps, np.full(6, 1.0))) == 7


MEANT: dict[str, tuple[list[float], list[float] | None]] = {
    "even": ([2.0] * 9, None),
    "even, with gaps between thin slices": ([10.0] * 9, [1.0] * 10),
    "another step further up": ([4.0] * 6 + [1.08] + [7.0] * 7, None),
    "twice as thick further up": (
        [5.0] * 6 + [7.5] + [10.0] * 6,
        [5.0] * 7 + [10.0] * 7,
    ),
    "twice as thick at once": ([5.0] * 6 + [10.0] * 6, [5.0] * 7 + [10.0] * 6),
    "uneven": ([1.1, 1.9, 1.4, 2.05, 1.3, 1.75, 1.2, 2.1], None),
}


@pytest.mark.parametrize("row", MEANT)
def test_what_was_made_so_lacks_nothing(row: str) -> None:
    steps, thick = MEANT[row]
    told = None if thick is None else np.array(thick)
    assert lost_slices(np.array(steps), told) == []


def test_twice_the_step_of_slices_as_thin_is_a_hole() -> None:
    steps = np.array([5.0] * 6 + [10.0] * 6)
    assert len(lost_slices(steps, np.full(13, 5.0))) == 6
