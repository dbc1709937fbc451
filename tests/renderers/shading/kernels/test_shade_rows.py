import math

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from numpy.typing import NDArray

from renderers.shading.kernels import pixel_block as b
from renderers.shading.kernels.shade_rows import fetch, finish, put, shown_span

f32 = np.float32
N = b.N


def part(w: NDArray[np.float32], slot: int) -> NDArray[np.float64]:
    return w[slot : slot + N].astype(np.float64)


def test_black_walls_return_no_bounce() -> None:
    w = np.zeros(b.SLOTS, np.float32)
    w[b.COVER : b.COVER + N] = 1
    w[b.E_RED : b.E_GREEN + N] = 5
    w[b.BOUNCE : b.BOUNCE + N] = 7
    finish(w, f32(1.15))
    for slot in (b.E_RED, b.E_GREEN, b.BOUNCE):
        assert not part(w, slot).any()


def test_finish_is_the_formula() -> None:
    rng = np.random.default_rng(3)
    w = np.zeros(b.SLOTS, np.float32)
    for slot in (b.RED, b.GREEN, b.BLUE, b.COVER, b.F0, b.SKIN):
        w[slot : slot + N] = rng.uniform(0.01, 0.9, N)
    for slot in (b.E_RED, b.E_GREEN, b.SPARK, b.BOUNCE, b.LR, b.LG):
        w[slot : slot + N] = rng.uniform(0, 4, N)
    albedo = np.stack([part(w, s) for s in (b.RED, b.GREEN, b.BLUE)])
    wraps = (
        np.minimum(0.25 * part(w, b.LR), 0.35),
        np.minimum(0.25 * part(w, b.LG), 0.2),
    )
    red, green = (
        part(w, slot) / (1 + wrap) ** 2
        for slot, wrap in zip((b.E_RED, b.E_GREEN), wraps, strict=True)
    )
    direct = np.stack([red, green, green])
    indirect = 1.15 * part(w, b.BOUNCE)
    body = albedo * (direct + indirect * albedo / (1 - 0.6 * albedo))
    body *= (1 - part(w, b.F0)) / math.pi
    spark = part(w, b.SPARK) * (1 - 0.7 * part(w, b.SKIN)) / (2 * math.pi)
    expected = part(w, b.COVER) * (body + spark)
    finish(w, f32(1.15))
    got = np.stack([part(w, s) for s in (b.E_RED, b.E_GREEN, b.BOUNCE)])
    np.testing.assert_allclose(got, expected, rtol=1e-5)


@pytest.mark.parametrize("width", [1, 15, 16, 37])
def test_a_block_holds_its_pixels_and_nothing_beyond(width: int) -> None:
    rng = np.random.default_rng(width)
    height, y0, first, last = 7, 4, 5, 7
    depth = rng.uniform(1, 9, (height, width)).astype(np.float32)
    depth[5, ::3] = np.inf
    coverage = rng.uniform(0.1, 1, (height, width)).astype(np.float32)
    coverage[6, ::5] = 0
    normal, lens = rng.normal(size=(2, height, width, 3)).astype(np.float32)
    axes, to_voxel = rng.normal(size=(2, 3, 3)).astype(np.float32)
    eye = np.array([5, 6, 7], np.float32)
    for x0 in range(0, width, b.W):
        w = np.full(b.SLOTS, np.nan, np.float32)
        fetch(
            w, depth, normal, coverage, lens, axes, to_voxel, eye, f32(0.01), y0, x0,
            (first, last),
        )  # fmt: skip
        assert np.isfinite(w[: b.FOOT + N]).all()
        for i in range(N):
            y, x = y0 + i // b.W, x0 + i % b.W
            inside = first <= y < last and x < width
            if not (inside and coverage[y, x] > 0 and np.isfinite(depth[y, x])):
                assert w[b.COVER + i] == 0
                continue
            ray = axes.astype(np.float64).T @ lens[y, x]
            point = depth[y, x] * ray
            facing = max(float(-ray @ normal[y, x]), 0.12)
            assert w[b.COVER + i] == coverage[y, x]
            assert_array_equal(w[b.NX + i : b.NX + 3 * N : N], normal[y, x])
            for slot, expected in (
                (b.DX, ray),
                (b.PX, point),
                (b.UX, to_voxel @ point + eye),
            ):
                got = w[slot + i : slot + 3 * N : N]
                np.testing.assert_allclose(got, expected, rtol=1e-5, atol=1e-4)
            assert w[b.FOOT + i] == pytest.approx(depth[y, x] * 0.01 / facing, rel=1e-3)


@pytest.mark.parametrize("width", [1, 16, 37])
def test_put_writes_its_pixels_and_nothing_beyond(width: int) -> None:
    rng = np.random.default_rng(0)
    picture = np.full((7, width, 3), -1, np.float32)
    expected = picture.copy()
    for x0 in range(0, width, b.W):
        w = rng.random(b.SLOTS).astype(np.float32)
        put(w, picture, 4, x0, 5, 7)
        for y in (5, 6):
            for x in range(x0, min(x0 + b.W, width)):
                i = (y - 4) * b.W + x - x0
                expected[y, x] = w[b.E_RED + i], w[b.E_GREEN + i], w[b.BOUNCE + i]
    assert_array_equal(picture, expected)


def test_the_shown_span_holds_everything_shown() -> None:
    depth = np.full((4, 70), 3, np.float32)
    coverage = np.zeros((4, 70), np.float32)
    assert shown_span(depth, coverage, 0, 4) == (70, 0)
    coverage[1, 20] = 1
    coverage[2, 69] = 1
    assert shown_span(depth, coverage, 0, 2) == (16, 32)
    assert shown_span(depth, coverage, 0, 4) == (16, 80)
    depth[2] = np.inf
    assert shown_span(depth, coverage, 0, 4) == (16, 32)
