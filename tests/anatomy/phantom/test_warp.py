from collections.abc import Callable

import numpy as np
import pytest

from anatomy.phantom.shapes import Affine, Array, Chain, Field, smooth_min, u, y
from anatomy.phantom.warp import Signed, Warp, bump, extruded, one_side

POINTS = np.random.default_rng(5).uniform(-12, 12, (4, 500))

Runner = Callable[..., Array]
"""The fixture `run`: a field, points, and points to a layer if they have layers."""

FIELDS: dict[str, Field] = {
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
    exact = field.evaluate(POINTS.astype(np.float32).astype(np.float64))
    assert np.abs(run(field, POINTS) - exact).max() < 1e-4


def test_a_drawn_out_line_has_the_distance_in_its_plane() -> None:
    points = np.array([[3.0], [77.0], [4.0], [0.0]])
    sheet = extruded(((0.0, 0.0), (0.0, 8.0)))
    assert sheet.evaluate(points)[0] == pytest.approx(3.0)


def test_one_side_keeps_the_field_there_and_nothing_elsewhere() -> None:
    points = np.array([[5.0, 5.0], [0, 0], [0, 0], [5.0, -5.0]])
    right = one_side(u - 8.0, 1.0).evaluate(points)
    assert right[0] == pytest.approx(-3.0)
    assert right[1] == pytest.approx(5.0)
