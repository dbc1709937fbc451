"""Ways through a straight tube, whose length is known."""

import numpy as np
import pytest

from anatomy.scan.approach import (
    MIDDLE_MM,
    SHORTEST_MM,
    STEP_MM,
    approach_from,
    find_approach,
)
from anatomy.scan.midplane import Midplane
from renderers.scene.volume import Volume

MIDDLE = Midplane(np.array([1.0, 0, 0]), 0.0, 1.0)


def tube(elevation_deg: float, length_mm: float, radius: float = 3.0) -> Volume:
    """A round tube from the origin to the back and up, closed at both ends."""
    way = np.array(
        [0, np.cos(np.radians(elevation_deg)), np.sin(np.radians(elevation_deg))]
    )
    axes = [
        np.arange(low, high + 0.1, 0.5) for low, high in ((-8, 60), (-8, 80), (-12, 12))
    ]
    z, y, x = np.meshgrid(*axes, indexing="ij")
    along = y * way[1] + z * way[2]
    aside = np.sqrt(np.maximum(x**2 + y**2 + z**2 - along**2, 0))
    distance = np.maximum(aside - radius, np.maximum(-along - 2, along - length_mm))
    return Volume(
        distance.astype(np.float32),
        np.full(3, 0.5),
        np.array([-12.0, -8, -8]),
        background=6.0,
    )


@pytest.mark.parametrize("elevation_deg", [0.0, 20.0, 35.0, 45.0])
def test_the_longest_way_runs_down_the_tube(elevation_deg: float) -> None:
    found = approach_from(tube(elevation_deg, 60.0), np.zeros(3))
    assert found.free_mm == pytest.approx(60.0, abs=STEP_MM + 1.5)
    angle = np.degrees(np.arctan2(found.axis[2], found.axis[1]))
    assert angle == pytest.approx(elevation_deg, abs=4.0)
    assert np.linalg.norm(found.axis) == pytest.approx(1)


def test_an_entrance_is_found_at_the_front() -> None:
    distance = tube(15.0, 60.0)
    found = find_approach(distance.values < 0, distance, MIDDLE)
    assert found is not None
    assert found.free_mm > 40
    assert found.pivot_mm[1] < 20
    assert distance.sample(found.pivot_mm) < -0.6
    again = find_approach(distance.values < 0, distance, MIDDLE)
    assert again is not None
    assert np.array_equal(found.pivot_mm, again.pivot_mm)
    assert np.array_equal(found.axis, again.axis)


def test_what_cannot_be_entered_is_refused() -> None:
    distance = tube(15.0, 60.0, radius=0.5)
    assert find_approach(distance.values < 0, distance, MIDDLE) is None
    with pytest.raises(ValueError, match="outside the imported"):
        approach_from(distance, np.array([0.0, 900, 0]))


def test_a_sinus_and_what_is_far_aside_are_no_entrance() -> None:
    distance = tube(15.0, 60.0)
    air = distance.values < 0
    assert find_approach(np.zeros_like(air), distance, MIDDLE) is None
    aside = Midplane(np.array([1.0, 0, 0]), MIDDLE_MM + 4.0, 1.0)
    assert find_approach(air, distance, aside) is None
    # a way ends where the passages do, though the air goes on
    origin, step = distance.origin_mm[1], distance.spacing_mm[1]
    near = air & (origin + step * np.arange(air.shape[1])[:, None] < 35)
    found = find_approach(near, distance, MIDDLE)
    assert found is not None
    assert (found.pivot_mm + found.free_mm * found.axis)[1] < 36


def test_a_way_of_less_than_two_centimetres_is_none() -> None:
    short = tube(15.0, SHORTEST_MM - 4.0)
    assert find_approach(short.values < 0, short, MIDDLE) is None
