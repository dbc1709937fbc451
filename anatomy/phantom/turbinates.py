"""The turbinates and the uncinate process of one side, as solids in the cavity."""

from dataclasses import dataclass

import numpy as np

from anatomy.phantom.fixed_shapes import SHAPES
from anatomy.phantom.parameters import PhantomParameters
from anatomy.phantom.program import Row
from anatomy.phantom.shapes import (
    Affine,
    Field,
    FlatTube,
    Mark,
    depth_table,
    height_table,
    smooth_max,
    smooth_min,
    u,
    y,
    z,
)
from anatomy.phantom.uncinate import process
from anatomy.tissue import Side


@dataclass(frozen=True, slots=True)
class Turbinates:
    """The solids that stand in the cavity."""

    inferior: Field
    middle: Field
    superior: Field
    uncinate: Field


MEDIAL_MM, LATERAL_MM = 2.8, 2.5
"""A surgeon pushes a middle turbinate so far towards the septum at most, nearly to it;
and its lower part so far away from it."""


def middle_bow(parameters: PhantomParameters, side: Side) -> Field:
    """Return how far the middle turbinate's lamella is bowed sideways.

    One that a surgeon has put to a side is bent about its roots at skull base, axilla
    and basal lamella, which stay.
    """
    bow: Field = depth_table(
        [10, 16, 24, 33, 42, 51], [-0.4, 0.0, 0.6, 0.9, 0.6, 0.0], 3.0
    ) * height_table([12, 22, 30, 38, 46], [0.1, 0.7, 1.0, 0.7, 0.1], 3.0)
    if parameters.has("medialised-turbinate", side):
        bow = bow - Affine(MEDIAL_MM) * (
            depth_table([12, 18, 23, 31, 40], [0.3, 0.5, 0.9, 1.0, 0.0], 3.0)
            * height_table([22, 28, 35, 45], [0.6, 1.0, 0.8, 0.0], 3.0)
        )
    if parameters.has("lateralised-turbinate", side):
        bow = bow + Affine(LATERAL_MM) * (
            depth_table([15, 22, 30, 46, 54], [0.2, 0.5, 1.0, 1.0, 0.6], 3.0)
            * height_table([31, 39], [1.0, 0.0], 2.0)
        )
    return bow


def middle_lean(parameters: PhantomParameters, side: Side) -> Field:
    """Return the lateral position of the middle turbinate's lamella over the height.

    A paradoxical turbinate curves outwards to its lower edge instead of inwards.
    """
    low = (
        (8.0, 6.7, 5.7)
        if parameters.has("paradoxical-turbinate", side)
        else (6.75, 5.68, 5.36)
    )
    return height_table([20, 26, 30, 38, 45], [*low, 4.9, 4.3], 3.0)


def inferior_lift() -> Field:
    """Return how far the inferior concha's bone lies above its middle course."""
    return depth_table([8, 22, 32, 42, 49], [0.0, -0.4, 0.3, 1.5, 2.6], 4.0)


def turbinates(parameters: PhantomParameters, side: Side) -> Turbinates:
    """Build the three turbinates and the uncinate process."""
    return Turbinates(
        Mark(Row.INFERIOR, _inferior(parameters)),
        Mark(Row.MIDDLE, _middle(parameters, side)),
        Mark(Row.SUPERIOR, _superior()),
        Mark(Row.UNCINATE, process(parameters, side)),
    )


def _inferior(parameters: PhantomParameters) -> Field:
    g = parameters.congestion
    # A stout head, a lower edge that falls and rises again, and a tail that tapers.
    depths = [4.5, 5.2, 6.5, 9, 14, 24, 33, 42, 48, 51]
    swelling = np.array([0.0, 0.0, 1.0, 1.6, 1.8, 1.8, 1.8, 1.6, 0.9, 0.0])
    widths = [0.1, 1.2, 1.9, 2.5, 2.7, 2.7, 2.68, 2.6, 2.2, 0.1] + g * swelling
    inferior = FlatTube(
        depth_table(depths, [9.6, 9.6, 9.5, 9.4, 9.2, 9.2, 9.3, 9.5, 9.6, 9.6]),
        depth_table(
            depths, [10.9, 10.9, 10.8, 10.6, 10.2, 10.08, 10.2, 10.7, 11.2, 11.4]
        ),
        depth_table(depths, widths.tolist(), 0.3),
        depth_table(depths, [0.1, 1.9, 3.2, 4.3, 4.8, 4.8, 4.6, 3.8, 2.5, 0.2], 0.3),
    )
    inferior_tube = smooth_max(1.0, inferior, abs(y + 27.75) - 23.4)
    root = smooth_max(0.8, 9.2 - u, abs(z - 0.30 * u - 11.3) - 1.1)
    root = smooth_max(0.8, root, u - 15.0)
    root = smooth_max(1.5, root, abs(y + 27.5) - 21.5)
    return smooth_min(1.5, inferior_tube, root)


def _middle(parameters: PhantomParameters, side: Side) -> Field:
    g = parameters.congestion
    # The middle turbinate has a bulbous head, a curled lower edge, and a lamella that
    # leans and is bowed along y.
    bowed = (
        u
        - middle_bow(parameters, side)
        + (1.0 if parameters.is_operated(side) else 0.0)
    )
    depths = [14.5, 16.5, 20, 28, 42, 51, 53]
    centers = (5.9, 6.0, 6.3, 6.6, 6.7, 6.7, 6.8)
    curl = 0.9 if parameters.has("paradoxical-turbinate", side) else 0.0
    widths = (1.6, 2.0 + g, 1.8 + g, 1.5 + 0.8 * g)
    heights = (3.2, 4.0, 3.3, 2.9)
    if parameters.has("concha-bullosa", side):
        # The air cell of 1.8 mm half width lies behind bone and mucosa.
        widths, heights = (2.0, 2.9 + 0.5 * g, 2.8 + 0.5 * g, 1.9), (3.6, 5.2, 4.8, 3.2)
    head = FlatTube(
        depth_table(depths, [c + curl for c in centers]) + (u - bowed),
        depth_table(depths, [26.5, 25.5, 23.6, 22.5, 22.0, 21.8, 21.8]),
        depth_table(depths, [0.6, *widths, 1.2, 0.3], 0.4),
        depth_table(depths, [1.4, *heights, 2.2, 0.5], 0.4),
    )
    head_tube = smooth_max(1.2, head, abs(y + 33.75) - 19.4)
    edge = depth_table([14, 20, 28, 42, 52], [27, 23.6, 22.5, 22.0, 21.8])
    lean = middle_lean(parameters, side)
    reach = 18.7 - 0.05 * smooth_max(2.0, z - 36, 0.0)
    lamella = smooth_max(
        0.6, abs(bowed - lean) - 0.65, smooth_max(1.0, edge - z, abs(y + 34) - reach)
    )
    front = height_table([20, 26, 38, 46], [-15, -14.5, -16.5, -20], 2.0)
    lamella = smooth_max(1.5, lamella, y - front)
    # The axilla: the head hangs from the lateral wall by a neck.
    neck = SHAPES["turbinate neck"]
    return smooth_min(2.6, smooth_min(3.0, head_tube, neck), lamella)


def _superior() -> Field:
    depths = [38, 41, 46, 51, 53]
    flange = FlatTube(
        depth_table(depths, [5.2, 5.2, 5.2, 5.3, 5.4]),
        depth_table(depths, [38, 36.6, 34.8, 33.4, 33.0]),
        depth_table(depths, [0.1, 0.8, 1.0, 0.8, 0.1], 0.3),
        depth_table(depths, [0.2, 1.6, 2.0, 1.6, 0.2], 0.3),
    )
    flange_tube = smooth_max(0.8, flange, abs(y + 45.5) - 7.6)
    plate = smooth_max(
        0.5,
        abs(u - 5.3) - 0.5,
        smooth_max(1.0, depth_table([38, 52], [37, 33]) - z, abs(y + 46) - 6.5),
    )
    return smooth_min(1.0, flange_tube, plate)
