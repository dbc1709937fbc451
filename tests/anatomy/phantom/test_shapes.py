from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from anatomy.phantom.program import Encoder
from anatomy.phantom.shapes import (
    Affine,
    Array,
    Cells,
    Chain,
    Ellipsoid,
    Field,
    FlatTube,
    Signed,
    Table,
    Warp,
    bump,
    depth_table,
    extruded,
    height_table,
    one_side,
    smooth_max,
    smooth_min,
    u,
    y,
    z,
)

RNG = np.random.default_rng(5)
POINTS = RNG.uniform(-15, 15, (4, 700))

Runner = Callable[..., Array]
"""The fixture `run`: a field, points, and points to a layer if they have layers."""

FIELDS: dict[str, Field] = {
    "affine": 2.0 * u - 3.0 + 0.5 * y,
    "table": Table(2, (-10, -2, 5), (1, 4, -2), 1.5),
    "sharp table": height_table([-3, 3], [0, 2], 0.0),
    "chain": Chain(((0, 0, 0), (4, 5, -3), (9, 5, 1)), (1, 2, 0.5)),
    "ellipsoid": Ellipsoid((1, 2, 3), (2, 5, 4)),
    "tube": FlatTube(
        Affine(1.0), depth_table([-5, 5], [0, 2]), Affine(2.0), Affine(3.0)
    ),
    "blend": smooth_min(2.0, u, y, z),
    "cut": smooth_max(1.0, abs(u) - 3.0, -y, z * u * 0.1),
    "cells": Cells(
        ((-5, 0, 0), (5, 1, 0), (0, 6, 3), (0, -5, -4)),
        (1.5, -0.5, 0.0, 0.8),
        0.5,
        0.8,
    ),
    "warp": Warp(y * 0.2, Affine(1.0), u * 0.1, Chain(((0, 0, 0), (3, 4, 5)), (1, 2))),
    "between": smooth_min(1.0, u, Warp(y, u, Affine(0.0), y), y),
    "extruded": extruded(((0, 0), (3, 4), (6, 4)), y * 0.1, 1.0),
    "signed": Signed(),
    "one side": one_side(u - 3.0, -1.0),
    "bump": bump((-6, 0, 6), (-5, 0, 5)),
}


@pytest.mark.parametrize("name", FIELDS)
def test_the_compiled_program_means_what_the_tree_means(name: str, run: Runner) -> None:
    field = FIELDS[name]
    # the row of signed distances is for what asks for the side
    points = POINTS if name in ("signed", "one side") else POINTS[:3]
    exact = field.evaluate(points.astype(np.float32).astype(np.float64))
    assert np.abs(run(field, POINTS) - exact).max() < 1e-4


@pytest.mark.parametrize("name", FIELDS)
def test_a_points_value_has_the_same_bits_in_any_block(name: str, run: Runner) -> None:
    whole = run(FIELDS[name], POINTS)
    for size in (1, 7, 64):
        parts = [
            run(FIELDS[name], POINTS[:, i : i + size])
            for i in range(0, POINTS.shape[1], size)
        ]
        assert np.array_equal(whole, np.concatenate(parts))


@pytest.mark.parametrize("name", FIELDS)
@pytest.mark.parametrize("shape", [(8, 8, 8), (3, 5, 2), (1, 4, 7), (6, 1, 1)])
def test_points_in_layers_have_the_bits_of_points_alone(
    name: str, shape: tuple[int, int, int], run: Runner
) -> None:
    axes = (np.linspace(-7, 8, count) for count in shape)
    high, back, side = np.meshgrid(*axes, indexing="ij")
    points = np.stack([side.ravel(), back.ravel(), high.ravel(), side.ravel()])
    layered = run(FIELDS[name], points, shape[1] * shape[2])
    assert np.array_equal(layered, run(FIELDS[name], points))


@given(st.floats(-5, 5), st.floats(-5, 5), st.floats(0.1, 4))
def test_a_smooth_minimum_is_bounded_and_exact_out_of_reach(
    a: float, b: float, k: float
) -> None:
    point = np.zeros((3, 1))
    value = float(smooth_min(k, a, b).evaluate(point)[0])
    assert min(a, b) - k / 4 - 1e-12 <= value <= min(a, b)
    if abs(a - b) >= k:
        assert value == min(a, b)
    assert value == -float(smooth_max(k, -a, -b).evaluate(point)[0])


@settings(max_examples=50)
@given(st.lists(st.floats(-9, 9), min_size=2, max_size=6))
def test_a_sharp_table_interpolates_linearly(values: list[float]) -> None:
    knots = tuple(float(3 * i) for i in range(len(values)))
    points = np.zeros((3, 41))
    points[2] = np.linspace(-5, 20, 41)
    table = Table(2, knots, tuple(values), 0.0)
    assert table.evaluate(points) == pytest.approx(
        np.interp(points[2], knots, values), abs=1e-9
    )


def test_cells_of_equal_reach_part_at_the_plane_between_their_seeds() -> None:
    cells = Cells(((-4, 0, 0), (4, 0, 0)), (0.7, 0.7), 0.5, 0.8)
    points = np.array([[-3.5, 0, 0], [0.0, 0, 0], [0.0, 3, 1], [3.0, 0, 0]]).T
    assert cells.evaluate(points) == pytest.approx([0.5 - 3.5, 0.5, 0.5, 0.5 - 3])


@given(st.floats(-2, 2), st.floats(-6, 6), st.floats(-6, 6))
def test_the_wall_between_cells_has_its_thickness_where_it_is_bent(
    reach: float, b: float, c: float
) -> None:
    """The wall is the hyperboloid whose points are `reach` nearer to one seed."""
    half = 0.3
    cells = Cells(((-4, 0, 0), (4, 0, 0)), (reach, 0.0), half, 0.8)
    a = reach / 2
    # A hyperboloid of revolution about u: semi-axes a and sqrt(16 - a^2).
    on = a * np.sqrt(1 + (b * b + c * c) / (16 - a * a))
    middle = np.array([[on], [b], [c]])
    assert cells.evaluate(middle)[0] == pytest.approx(half, abs=1e-6)
    away = [(middle - [[s], [0], [0]]) for s in (-4.0, 4.0)]
    normal = away[0] / np.linalg.norm(away[0]) - away[1] / np.linalg.norm(away[1])
    normal /= np.linalg.norm(normal)
    for sign in (-1.0, 1.0):
        face = float(cells.evaluate(middle + sign * half * normal)[0])
        assert abs(face) < 0.04


def test_the_distance_to_a_capsule_is_exact() -> None:
    chain = Chain(((0, 0, 0), (0, 10, 0)), (1, 1))
    points = np.array([[3.0, 0, 0], [5.0, 13.0, -4.0], [4.0, 0, 0]])
    assert chain.evaluate(points) == pytest.approx([4.0, 2.0, 3.0])


def test_the_centre_of_an_ellipsoid_is_inside(run: Runner) -> None:
    body = Ellipsoid((1, 2, 3), (2, 5, 4))
    center = np.array([[1.0], [2.0], [3.0]])
    assert body.evaluate(center)[0] == pytest.approx(-2.0)
    assert run(body, center)[0] == pytest.approx(-2.0)


def test_affine_arithmetic_folds_into_one_instruction() -> None:
    encoder = Encoder()
    (2.0 * (u - 3.0) + (y - z) * 0.5 - 1.0).encode(encoder)
    encoder.finish_field()
    assert len(encoder.program().code) == 1


def test_a_table_with_unordered_knots_is_refused() -> None:
    with pytest.raises(ValueError, match="increasing knots"):
        Table(1, (0, 0), (1, 2))


def test_a_drawn_out_line_has_the_distance_in_its_plane() -> None:
    points = np.array([[3.0], [77.0], [4.0], [0.0]])
    sheet = extruded(((0.0, 0.0), (0.0, 8.0)))
    assert sheet.evaluate(points)[0] == pytest.approx(3.0)


def test_one_side_keeps_the_field_there_and_nothing_elsewhere() -> None:
    points = np.array([[5.0, 5.0], [0, 0], [0, 0], [5.0, -5.0]])
    right = one_side(u - 8.0, 1.0).evaluate(points)
    assert right[0] == pytest.approx(-3.0)
    assert right[1] == pytest.approx(5.0)
