import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from anatomy.phantom.parameters import PhantomParameters
from anatomy.phantom.phantom import Phantom
from anatomy.queries.landmarks import landmarks
from anatomy.tissue import Side
from benchmarks.phantom_figures.passage_widths import (
    half_head,
    nearest_mm,
    voxel_at,
    widest_mm,
)

SPACING_MM = 0.25


def tube(radius_mm: float) -> np.ndarray:
    """Two rooms joined by a round tube along z: a distance, negative inside."""
    axis = SPACING_MM * np.arange(-24, 25)
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij")
    rooms = [np.sqrt(x**2 + y**2 + (z - s * 3.5) ** 2) - 2.5 for s in (-1, 1)]
    way = np.maximum(np.hypot(x, y) - radius_mm, np.abs(z) - 6.0)
    return np.asarray(np.minimum(np.minimum(*rooms), way))


@given(st.floats(0.1, 2.4))
def test_the_ball_is_as_wide_as_the_tube(radius_mm: float) -> None:
    ends = (10, 24, 24), (38, 24, 24)
    found = widest_mm(tube(radius_mm), ends[0], [ends[1]])
    # The axis of the tube runs through voxels: only the halving is left, 0.012 mm.
    assert found == pytest.approx(radius_mm, abs=0.013)


def test_the_widest_of_several_ways_counts_and_a_wall_is_none() -> None:
    distance = tube(1.0)
    start, goal, other = (10, 24, 24), (38, 24, 24), (9, 24, 24)
    assert widest_mm(distance, start, [goal, other]) > 2.0
    distance[24] = 1.0
    assert widest_mm(distance, start, [goal]) == 0.0


def test_the_most_open_voxel_is_found_near_a_place(nose: Phantom) -> None:
    place = nose.landmarks["choana, left"].position_mm
    at = voxel_at(nose, place, 3)
    found = nose.ct.origin_mm + nose.spacing_mm * np.array(at[::-1])
    assert np.abs(found - place).max() <= 3.5 * nose.spacing_mm
    assert nose.distance.values[at] <= nose.distance.values[voxel_at(nose, place, 0)]


def test_a_ball_too_wide_for_the_nostril_comes_nowhere() -> None:
    half = half_head(PhantomParameters(), Side.LEFT, 0.8)
    assert nearest_mm(half, Side.LEFT, "maxillary", 14.0) == np.inf
    small, large = (nearest_mm(half, Side.LEFT, "sphenoid", d) for d in (1.0, 4.0))
    assert small <= large < 40.0
    # Where all is air the ball comes as near as a voxel.
    void = dataclasses.replace(
        half.distance, values=np.full_like(half.distance.values, -8.0)
    )
    open_half = dataclasses.replace(half, distance=void)
    assert nearest_mm(open_half, Side.LEFT, "sphenoid", 4.0) < 0.8


def test_the_way_to_an_ostium_that_a_side_lacks_is_refused(nose: Phantom) -> None:
    bare = PhantomParameters(frontal_scale=0.0)
    head = dataclasses.replace(nose, parameters=bare, landmarks=landmarks(bare))
    with pytest.raises(ValueError, match="left side of this head has no frontal"):
        nearest_mm(head, Side.LEFT, "frontal", 2.7)
