import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from renderers.art.ranks.messages import ProtocolError
from renderers.art.regions import (
    STRIP_PX,
    Gather,
    Region,
    deal_regions,
    region_payload,
    skew_of,
    strips,
)


@given(width=st.integers(1, 200), height=st.integers(1, 150), ranks=st.integers(1, 9))
def test_every_pixel_is_dealt_once(width: int, height: int, ranks: int) -> None:
    dealt = np.zeros((height, width), int)
    for rank in range(ranks):
        for region in deal_regions(width, height, rank, ranks):
            dealt[region.rows, region.columns] += 1
    assert np.all(dealt == 1)


@given(
    width=st.integers(1, 200),
    height=st.integers(1, 150),
    pixels=st.integers(1, 5000),
    seed=st.integers(0, 99),
)
def test_strips_cover_what_is_left_once(
    width: int, height: int, pixels: int, seed: int
) -> None:
    random = np.random.default_rng(seed)
    done = np.zeros((height, width), np.bool_)
    done[: random.integers(height + 1)] = True
    covered = np.zeros((height, width), int)
    for strip in strips(done, pixels):
        covered[strip.rows, strip.columns] += 1
        # No more rays than asked for, unless those of one tile are.
        assert strip.pixels <= max(pixels, STRIP_PX**2)
        assert not done[strip.rows, strip.columns].all()
        assert strip.left % STRIP_PX == strip.top % STRIP_PX == 0
    assert covered.max(initial=0) <= 1
    assert np.all(covered[~done] == 1)


@pytest.mark.parametrize("ranks", [2, 3, 4, 8, 16])
def test_work_is_spread_over_rows_and_columns(ranks: int) -> None:
    for rank in range(ranks):
        regions = deal_regions(512, 512, rank, ranks)
        assert len(regions) == pytest.approx(256 / ranks, abs=1)
        columns = {region.left for region in regions}
        # Row by row would give one rank 16 / ranks columns of 16.
        assert len(columns) > 16 / ranks


def test_regions_become_the_picture_in_any_order() -> None:
    rng = np.random.default_rng(0)
    value = rng.random((50, 70, 4), np.float32)
    depth = rng.random((50, 70), np.float32)
    regions = [r for k in range(3) for r in deal_regions(70, 50, k, 3)]
    regions = [regions[i] for i in rng.permutation(len(regions))]
    gather = Gather(70, 50)
    for region in regions:
        gather.add_payload(
            region_payload(
                region,
                value[region.rows, region.columns].reshape(-1, 4),
                depth[region.rows, region.columns].reshape(-1),
            )
        )
    assert gather.missing == 0
    assert np.array_equal(gather.value, value)
    assert np.array_equal(gather.depth, depth)


def test_odd_regions_are_refused() -> None:
    gather = Gather(8, 8)
    good = region_payload(
        Region(0, 0, 4, 4), np.zeros((16, 4), np.float32), np.zeros(16, np.float32)
    )
    outside = region_payload(
        Region(6, 0, 10, 4), np.zeros((16, 4), np.float32), np.zeros(16, np.float32)
    )
    for payload in (good[:-1], good[:8], outside):
        with pytest.raises(ProtocolError):
            gather.add_payload(payload)
    assert gather.missing == 64


@given(ranks=st.integers(1, 300))
def test_shifted_rows_run_through_all_ranks(ranks: int) -> None:
    skew = skew_of(ranks)
    assert {row * skew % ranks for row in range(ranks)} == set(range(ranks))
    assert abs(skew - 0.618 * ranks) <= max(0.1 * ranks, 3)


def test_what_was_not_written_shows_nothing_in_the_end() -> None:
    """As what is written from the beginning does."""
    region = Region(2, 1, 6, 4)
    value, depth = np.full((12, 4), 0.5, np.float32), np.full(12, 9, np.float32)
    usual, late = Gather(8, 5), Gather(8, 5, filled=False)
    for gather in (usual, late):
        gather.add(region, value, depth)
    late.fill()
    assert np.array_equal(late.value, usual.value)
    assert np.array_equal(late.depth, usual.depth)
    assert np.isinf(late.depth[0, 0])
    empty = Gather(3, 2, filled=False)
    empty.fill()
    assert not empty.value.any()
    assert np.isinf(empty.depth).all()
