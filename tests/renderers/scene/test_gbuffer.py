"""Merging G-buffers is taking the nearer surface: a semilattice with an identity."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from renderers.scene import GBuffer, Material

SEEDS = st.integers(0, 10**6)


def random_buffer(seed: int, height: int = 6, width: int = 5) -> GBuffer:
    rng = np.random.default_rng(seed)
    buffer = GBuffer.empty(height, width)
    hit = rng.uniform(size=(height, width)) < 0.6
    normal = rng.normal(size=(height, width, 3))
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    buffer.depth_mm[hit] = rng.uniform(1, 100, hit.sum())
    buffer.normal[hit] = normal[hit]
    buffer.coverage[hit] = rng.uniform(0.1, 1, hit.sum())
    buffer.material[hit] = rng.integers(0, len(Material), hit.sum())
    return buffer


def equal(a: GBuffer, b: GBuffer) -> bool:
    return all(
        np.array_equal(x, y)
        for x, y in (
            (a.depth_mm, b.depth_mm),
            (a.normal, b.normal),
            (a.coverage, b.coverage),
            (a.material, b.material),
        )
    )


@given(seed=SEEDS)
def test_merging_is_idempotent_and_empty_changes_nothing(seed: int) -> None:
    a = random_buffer(seed)
    empty = GBuffer.empty(*a.size)
    assert equal(a.nearest(a), a)
    assert equal(a.nearest(empty), a)
    assert equal(empty.nearest(a), a)


@given(seed=SEEDS)
def test_merging_does_not_depend_on_order_or_grouping(seed: int) -> None:
    a, b, c = (random_buffer(seed + i) for i in range(3))
    assert equal(a.nearest(b), b.nearest(a))
    assert equal(a.nearest(b).nearest(c), a.nearest(b.nearest(c)))


@given(seed=SEEDS)
def test_each_pixel_is_one_of_the_two_whole_and_the_nearer(seed: int) -> None:
    a, b = random_buffer(seed), random_buffer(seed + 1)
    merged = a.nearest(b)
    assert np.array_equal(merged.depth_mm, np.minimum(a.depth_mm, b.depth_mm))
    for source in (a, b):
        shown = merged.depth_mm == source.depth_mm
        for name in ("normal", "coverage", "material"):
            found, given_ = getattr(merged, name), getattr(source, name)
            assert np.array_equal(found[shown], given_[shown])


def test_of_two_at_the_same_depth_the_first_wins() -> None:
    a, b = GBuffer.empty(1, 1), GBuffer.empty(1, 1)
    for buffer, material in ((a, Material.METAL), (b, Material.BONE)):
        buffer.depth_mm[:] = 4
        buffer.material[:] = material
    assert a.nearest(b).material[0, 0] == Material.METAL
    assert b.nearest(a).material[0, 0] == Material.BONE


def test_empty_shows_nothing_and_sources_stay_as_they_were() -> None:
    empty = GBuffer.empty(3, 4)
    assert empty.size == (3, 4)
    assert np.all(np.isposinf(empty.depth_mm))
    assert not empty.coverage.any()
    a, b = random_buffer(1), random_buffer(2)
    merged = a.nearest(b)
    merged.depth_mm[:] = 0
    assert equal(a, random_buffer(1))
    assert equal(b, random_buffer(2))


def test_bad_buffers_are_refused() -> None:
    good = GBuffer.empty(2, 3)
    with pytest.raises(ValueError, match="cannot merge"):
        good.nearest(GBuffer.empty(3, 2))
    with pytest.raises(ValueError, match="normal"):
        GBuffer(good.depth_mm, good.normal[:, :2], good.coverage, good.material)
    too_wide: Any = np.zeros((2, 3))
    with pytest.raises(ValueError, match="depth_mm"):
        GBuffer(too_wide, good.normal, good.coverage, good.material)
    with pytest.raises(ValueError, match="material"):
        GBuffer(
            good.depth_mm, good.normal, good.coverage, good.material.astype(np.int32)
        )


def test_every_so_many_th_pixel_is_kept() -> None:
    buffer = GBuffer.empty(5, 7)
    buffer.depth_mm[:] = np.arange(35).reshape(5, 7)
    buffer.coverage[::3, ::3] = 1
    buffer.normal[::3, ::3, 2] = 1
    buffer.material[::3, ::3] = Material.METAL
    part = buffer.every(3)
    assert part.size == (2, 3)
    assert part.depth_mm.tolist() == [[0, 3, 6], [21, 24, 27]]
    assert part.coverage.all()
    assert np.all(part.normal == [0, 0, 1])
    assert np.all(part.material == Material.METAL)
    whole = buffer.every(1)
    assert np.array_equal(whole.depth_mm, buffer.depth_mm)
