"""The labyrinth's form: narrow in front, round below, and another on either side."""

import numpy as np
import pytest
from numpy.typing import NDArray

from anatomy import PhantomParameters, draw_parameters
from anatomy.phantom.ethmoid import ethmoid_block
from anatomy.tissue import Side

STEP_MM = 0.02
ACROSS_MM = np.arange(2.0, 22.0, STEP_MM)


def inside(
    parameters: PhantomParameters, side: Side, depth_mm: float, height_mm: float
) -> NDArray[np.bool_]:
    """Tell where a line from the septum sideways runs within the labyrinth."""
    depth, height = (
        np.full_like(ACROSS_MM, depth_mm),
        np.full_like(ACROSS_MM, height_mm),
    )
    block = ethmoid_block(parameters, side)
    return block.evaluate(np.stack([ACROSS_MM, -depth, height])) < 0.0


def width_mm(
    parameters: PhantomParameters, side: Side, depth_mm: float, height_mm: float
) -> float:
    """Measure the labyrinth from the nose to the orbit."""
    return STEP_MM * np.count_nonzero(inside(parameters, side, depth_mm, height_mm))


@pytest.mark.parametrize("side", [Side.RIGHT, Side.LEFT])
def test_the_labyrinth_widens_from_front_to_rear(side: Side) -> None:
    for seed in range(20):
        parameters = draw_parameters(seed)
        front, middle, rear = (
            width_mm(parameters, side, depth, 40.0) for depth in (20.0, 30.0, 42.0)
        )
        assert front < 0.76 * rear
        assert front < middle < 1.02 * rear


@pytest.mark.parametrize("side", [Side.RIGHT, Side.LEFT])
def test_both_its_walls_taper(side: Side) -> None:
    """The orbit's wall and the nose's, not one of them alone."""
    for seed in range(20):
        parameters = draw_parameters(seed)
        ends = []
        for depth in (22.0, 42.0):
            across = ACROSS_MM[inside(parameters, side, depth, 40.0)]
            ends.append((across[0], across[-1]))
        (front_inner, front_outer), (rear_inner, rear_outer) = ends
        assert front_inner > rear_inner + 0.5
        assert front_outer < rear_outer - 1.0


def test_sides_are_not_mirrored() -> None:
    """Even where both are as wide as each other, their walls take other courses."""
    parameters = PhantomParameters()
    depths = np.arange(26.0, 50.0, 2.0)
    courses = []
    for side in (Side.RIGHT, Side.LEFT):
        walls = [ACROSS_MM[inside(parameters, side, d, 36.0)] for d in depths]
        courses.append([(across[0], across[-1]) for across in walls])
    apart = np.abs(np.diff(courses, axis=0)[0]).max(axis=0)
    assert np.all(apart > 0.3)
