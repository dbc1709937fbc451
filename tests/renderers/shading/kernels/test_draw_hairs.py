import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal
from numpy.typing import NDArray

from renderers.shading.kernels.draw_hairs import draw_strands, light_strands

SIZE = 40
LENS = np.ones((SIZE, SIZE, 3), np.float32)
FAR = np.full((SIZE, SIZE), 50, np.float32)
Floats = NDArray[np.float32]


def line(
    x0: float, y0: float, x1: float, y1: float, *, half: float, depth: float = 10
) -> Floats:
    """One strand of four pieces: column, row, distance, half width."""
    s = np.linspace(0, 1, 5)
    placed = np.stack(
        [x0 + s * (x1 - x0), y0 + s * (y1 - y0), 0 * s + depth, 0 * s + half], axis=1
    )
    return placed[None].astype(np.float32)


def drawn(
    placed: Floats,
    depth: Floats = FAR,
    rows: tuple[int, ...] = (SIZE,),
    per_unit: float = 50.0,
) -> Floats:
    """Draw black strands over white, in parts that end before `rows`."""
    radiance = np.ones((SIZE, SIZE, 3), np.float32)
    colour = np.zeros((*placed.shape[:2], 3), np.float32)
    first = 0
    for last in rows:
        order = np.arange(len(placed))
        draw_strands(
            placed, colour, order, depth, LENS, per_unit, radiance, first, last
        )
        first = last
    return radiance


@given(st.floats(0.05, 2.5), st.floats(0, 1), st.floats(0, 1), st.floats(-8, 8))
def test_a_hair_covers_its_own_area_wherever_it_lies(
    half: float, dx: float, dy: float, slant: float
) -> None:
    placed = line(8 + dx, 14 + dy, 30 + dx, 14 + dy + slant, half=half)
    length = float(np.hypot(22, slant))
    covered = (1 - drawn(placed)[..., 0]).sum()
    # a box of one pixel across the line, and its rounded ends
    low = 2 * half * length
    slack = 0.12 * low + np.pi * (half + 0.5) ** 2
    assert low * 0.9 <= covered <= low + slack


@given(st.floats(0, 1))
def test_a_hair_that_moves_by_less_than_a_pixel_does_not_flicker(shift: float) -> None:
    at_rest = (1 - drawn(line(8, 5, 30, 30, half=0.3))[..., 0]).sum()
    moved = (1 - drawn(line(8 + shift, 5, 30 + shift, 30, half=0.3))[..., 0]).sum()
    assert moved == pytest.approx(at_rest, rel=0.06)


def test_what_is_nearer_hides_a_hair() -> None:
    placed = line(5, 20, 35, 20, half=1.5)
    depth = FAR.copy()
    depth[:, 20:] = 8
    found = drawn(placed, depth)
    assert found[20, 6:18].max() < 0.01
    assert (found[:, 20:] == 1).all()


def test_nothing_is_drawn_outside_the_lens() -> None:
    lens = LENS.copy()
    lens[:, 20:] = 0
    radiance = np.ones((SIZE, SIZE, 3), np.float32)
    placed = line(5, 20, 35, 20, half=1.5)
    colour = np.zeros((*placed.shape[:2], 3), np.float32)
    draw_strands(placed, colour, np.arange(1), FAR, lens, 50.0, radiance, 0, SIZE)
    assert (radiance[:, 20:] == 1).all()


def test_rows_in_parts_are_the_same_bits() -> None:
    rng = np.random.default_rng(5)
    ends = rng.uniform(0, SIZE, (12, 4)).tolist()
    placed = np.concatenate(
        [line(*end, half=0.1 + 0.15 * n) for n, end in enumerate(ends)]
    )
    assert_array_equal(drawn(placed), drawn(placed, rows=(3, 17, 18, SIZE)))


def test_a_point_out_of_view_draws_nothing() -> None:
    placed = line(5, 20, 35, 20, half=1.5)
    placed[0, :, 3] = 0
    assert (drawn(placed) == 1).all()


@pytest.mark.parametrize("depth", [3.0, 4.5])
def test_a_near_hair_is_out_of_focus_and_covers_no_more(depth: float) -> None:
    """The pupil's width, seen from the hair, is what its edges are spread over."""
    per_unit = 120.0
    sharp = 1 - drawn(line(-60, 20, 100, 20, half=2, depth=10), per_unit=per_unit)
    soft = 1 - drawn(line(-60, 20, 100, 20, half=2, depth=depth), per_unit=per_unit)
    spread = 0.09 * per_unit * (1 / depth - 1 / 6)
    column = soft[:, 20, 0]
    assert column.sum() == pytest.approx(sharp[:, 20, 0].sum(), rel=0.02)
    assert (column > 1e-3).sum() == pytest.approx(2 * (2 + spread), abs=1)
    # all along, joints of pieces included
    np.testing.assert_allclose(soft, np.broadcast_to(soft[:, 20:21], soft.shape))


def test_a_hair_before_the_lens_is_pushed_aside() -> None:
    def middle(depth: float) -> float:
        placed = line(5, 20, 35, 20, half=3, depth=depth)
        return float(1 - drawn(placed, per_unit=1.0)[20, 20, 0])

    found = [middle(depth) for depth in (0.5, 1.0, 1.75, 2.5, 8.0)]
    np.testing.assert_allclose(found, [0, 0, 0.5, 1, 1], atol=1e-6)


def test_a_hair_near_the_fibres_does_not_glow() -> None:
    """Below 4 mm the light on it grows no more; beyond, it is 1 / d^2 as before."""

    def lit(depth: float) -> float:
        x = np.linspace(-1e-3, 1e-3, 5)
        points = np.stack([x, 0 * x, 0 * x + depth], axis=1)[None]
        colour = np.zeros(points.shape, np.float32)
        light_strands(
            points,
            np.zeros((1, 3), np.float32),
            np.array([0.0, 0, 1]),
            0.0,
            1.0,
            np.full(3, 0.5, np.float32),
            0.01,
            np.ones((1, 5, 4), np.float32),
            colour,
        )
        return float(colour[0, 2, 0])

    assert lit(1) == pytest.approx(lit(4), rel=1e-4)
    assert lit(8) == pytest.approx(lit(4) / 4, rel=1e-4)


def test_light_along_a_hair_passes_it() -> None:
    """Kajiya and Kay: what falls across counts, with 1 / d^2 from the source."""
    along = np.stack([np.zeros(5), np.zeros(5), np.linspace(5, 6, 5)], axis=1)
    across = np.stack([np.linspace(-0.1, 0.1, 5), np.zeros(5), np.full(5, 5.0)], axis=1)
    points = np.stack([along, across])
    colour = np.zeros(points.shape, np.float32)
    light_strands(
        points,
        np.zeros((1, 3), np.float32),
        np.array([0.0, 0, 1]),
        0.0,
        3.0,
        np.full(3, 0.5, np.float32),
        0.0,
        np.ones((2, 5, 4), np.float32),
        colour,
    )
    assert colour[0].max() < 1e-3
    np.testing.assert_allclose(colour[1, 2], 3 * 0.5 / np.pi / 25, rtol=1e-3)
