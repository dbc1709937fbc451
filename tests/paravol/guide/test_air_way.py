import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from paravol.guide.air_way import AirWay, back_to_turn_mm, farthest_seen, length_mm
from renderers.scene import Volume
from scenarios.tasks.rules import is_in_sight

H = 0.5
SIZE = 41


def head(distance: NDArray[np.float64]) -> Volume:
    return Volume(
        distance.astype(np.float32), np.full(3, H), np.zeros(3), background=9.0
    )


def axes() -> tuple[NDArray[np.float64], ...]:
    z, y, x = (H * axis for axis in np.mgrid[:SIZE, :SIZE, :SIZE].astype(float))
    return z, y, x


def walled() -> Volume:
    """A wall across x with a hole of 3 mm at one corner."""
    z, y, x = axes()
    wall = 0.8 - np.abs(x - 10.0)
    hole = np.hypot(y - 16.0, z - 16.0) - 3.0
    return head(np.clip(np.minimum(wall, hole), -4.0, 4.0))


PLACES = st.tuples(*[st.floats(3.0, 17.0)] * 3)


@given(PLACES, PLACES)
def test_in_free_air_the_way_is_as_straight_as_voxels_allow(
    start: tuple[float, float, float], end: tuple[float, float, float]
) -> None:
    a, b = np.array(start), np.array(end)
    chain = AirWay(head(np.full((SIZE,) * 3, -5.0)), a, b).chain(a)
    assert chain is not None
    assert np.linalg.norm(chain[0] - a) <= H
    assert np.linalg.norm(chain[-1] - b) <= H
    straight = float(np.linalg.norm(b - a))
    # octile: at most 1 / cos(atan(sqrt 2 - 1) ...) longer, and a voxel at both ends
    assert straight - 2 * H <= length_mm(chain) <= 1.15 * straight + 2 * H


def test_who_always_goes_to_the_farthest_point_in_sight_arrives_through_air() -> None:
    volume, place = walled(), np.array([18.0, 3.0, 3.0])
    at = np.array([2.0, 3.0, 3.0])
    way = AirWay(volume, at, place)
    flown = [at]
    for _ in range(20):
        chain = way.chain(at)
        assert chain is not None
        _, at = farthest_seen(volume, at, chain)
        flown.append(at)
        if is_in_sight(volume, at, place):
            break
    assert is_in_sight(volume, at, place)
    legs = np.linspace(flown[:-1], flown[1:], 40).reshape(-1, 3)
    assert volume.sample(legs).max() < 0.3
    whole = way.chain(flown[0])
    assert whole is not None
    assert length_mm(whole) > 30.0


def test_a_landmark_in_tissue_is_gone_to_where_the_air_sees_it() -> None:
    volume = walled()
    place = np.array([10.0, 4.0, 4.0])  # in the wall
    way = AirWay(volume, np.array([2.0, 3.0, 3.0]), place)
    assert volume.sample(way.end_mm[None])[0] < 0.0
    assert way.end_mm[0] < 10.0
    assert is_in_sight(volume, way.end_mm, place)


def test_a_closed_cell_has_no_way_in() -> None:
    z, y, x = axes()
    away = np.sqrt((x - 10) ** 2 + (y - 10) ** 2 + (z - 10) ** 2)
    cell = head(np.clip(1.5 - np.abs(away - 6.0), -4.0, 4.0))
    with pytest.raises(ValueError, match="no air"):
        AirWay(cell, np.array([1.0, 1.0, 1.0]), np.array([10.0, 10.0, 10.0]))
    with pytest.raises(ValueError, match="begins in tissue"):
        AirWay(head(np.full((SIZE,) * 3, 5.0)), np.zeros(3) + 5, np.zeros(3) + 15)


def test_a_shaft_turns_as_deep_as_nothing_is_in_its_sweep() -> None:
    """A post beside the shaft: it turns past it only when its tip is before it."""
    _, y, x = axes()
    post = head(np.clip(1.0 - np.hypot(x - 10.0, y - 12.0), -4.0, 4.0))
    pivot = np.array([6.0, 0.0, 10.0])
    deep, there = np.array([6.0, 17.0, 10.0]), np.array([16.0, 16.0, 10.0])
    back = back_to_turn_mm(post, pivot, deep, there)
    # the post's nearest point is 12 mm from the pivot, less its radius of 1
    assert 17.0 - 12.0 < back < 17.0 - 9.5
    before = pivot + (17.0 - back) * np.array([0.0, 1.0, 0.0])
    assert back_to_turn_mm(post, pivot, before, there) == 0.0
    assert back_to_turn_mm(post, pivot, deep, np.array([2.0, 16.0, 10.0])) == 0.0
    # behind the post no straight shaft gets
    hidden = pivot + 1.4 * (np.array([10.0, 12.0, 10.0]) - pivot)
    assert back_to_turn_mm(post, pivot, deep, hidden) == 0.0
