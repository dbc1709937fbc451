"""What is drawn with fits, or is refused with the bytes it needs."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from renderers.art.cells.memory_budget import (
    LEAST_CELLS,
    MemoryBudget,
    budget_for,
    require_cache,
    require_distances,
)

SHAPE = (40, 60, 50)
VOXELS = math.prod(SHAPE)


@given(
    seen=st.integers(0, 5000),
    brick=st.integers(1458, 300_000),
    whole=st.sampled_from([0, 2 * VOXELS, 4 * VOXELS]),
    limit=st.integers(VOXELS, 2_000_000_000),
    bricks=st.booleans(),
)
def test_what_is_chosen_fits_and_nothing_larger_would(
    seen: int, brick: int, whole: int, limit: int, bricks: bool
) -> None:
    def taken(budget: MemoryBudget) -> int:
        cells = seen if budget.cells is None else budget.cells
        makes = bricks or not budget.whole
        return VOXELS + budget.whole * whole + makes * (cells + 1) * brick

    least = VOXELS + (min(seen, LEAST_CELLS) + 1) * brick
    if not bricks and whole:
        least = min(least, VOXELS + whole)
    if least > limit:
        with pytest.raises(ValueError, match=r"at least [\d,]+ bytes and at most"):
            budget_for(SHAPE, seen, brick, whole, limit, bricks=bricks)
        return
    budget = budget_for(SHAPE, seen, brick, whole, limit, bricks=bricks)
    assert taken(budget) <= limit or not seen
    if budget.whole:
        assert whole
        return
    if whole:
        assert taken(MemoryBudget(None, True)) > limit
    if budget.cells is not None and 1 <= budget.cells < seen:
        assert taken(MemoryBudget(budget.cells + 1, False)) > limit


def test_what_does_not_fit_is_refused_with_its_bytes() -> None:
    with pytest.raises(ValueError, match=r"50 x 60 x 40 voxels.* at least 6,620,000 b"):
        budget_for(SHAPE, 900, 100_000, 0, 6_600_000, bricks=True)
    with pytest.raises(ValueError, match=r"needs 120,000 bytes.* at most 119,999"):
        require_distances(SHAPE, VOXELS - 1)
    require_distances(SHAPE, VOXELS)
    with pytest.raises(ValueError, match=r"900 cells takes 90,100,000 bytes"):
        require_cache(900, 100_000, 90_099_999)
    require_cache(900, 100_000, 90_100_000)
