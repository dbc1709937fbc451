"""Stacks of which slices were lost, and stacks that were made as they are."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from anatomy.scan.slice_steps import lost_slices


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
