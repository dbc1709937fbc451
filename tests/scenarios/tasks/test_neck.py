"""The neck between two rooms: closed forms, however the way to it stands."""

import itertools
import math

import numpy as np
import pytest
from numpy.typing import NDArray

from renderers.scene import Volume
from scenarios.tasks.neck import WIDE_MM, Neck
from tests.slow_cases import slow

Doubles = NDArray[np.float64]

HALF_MM, STEP_MM = 12.0, 0.5


def rooms(radius_mm: float, tilt_deg: float = 0.0, beside_mm: float = 0.0) -> Volume:
    """Return two rooms with a wall of 1 mm between, and a round hole through it.

    tilt_deg: of the wall about z. beside_mm: radius of another hole, 7 mm away.
    """
    count = round(2 * HALF_MM / STEP_MM) + 1
    axis = np.linspace(-HALF_MM, HALF_MM, count)
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij")
    turn = math.radians(tilt_deg)
    across = math.cos(turn) * x + math.sin(turn) * y
    through = math.cos(turn) * y - math.sin(turn) * x
    wall = 0.5 - np.abs(through)
    holes = [np.hypot(across, z) - radius_mm]
    if beside_mm > 0.0:
        holes.append(np.hypot(across - 7.0, z) - beside_mm)
    values = np.minimum(wall, np.minimum.reduce(holes))
    values = np.maximum(values, -5.0).astype(np.float32)
    return Volume(values, np.full(3, STEP_MM), np.full(3, -HALF_MM), background=-5.0)


START, END = np.array([0.0, -1.0, 0.0]), np.array([0.0, 6.0, 0.0])


@pytest.mark.parametrize("tilt_deg", [0.0, 15.0, 25.0, 38.0])
@pytest.mark.parametrize("radius_mm", [2.0, *slow(1.5, 3.0)])
def test_a_neck_is_as_large_as_the_hole(radius_mm: float, tilt_deg: float) -> None:
    """However aslant to its wall the way goes through it."""
    head = rooms(radius_mm, tilt_deg)
    area_mm2, passes_mm = Neck.between(head, START, END).opening(head)
    assert area_mm2 == pytest.approx(math.pi * radius_mm**2, rel=0.12)
    assert passes_mm == pytest.approx(radius_mm, abs=0.3)


@pytest.mark.parametrize("tilt_deg", [0.0, 25.0])
def test_widening_counts_and_nothing_beside_does(tilt_deg: float) -> None:
    neck = Neck.between(rooms(2.0, tilt_deg), START, END)
    for radius_mm in (2.0, 2.5, 3.5, 4.5):
        area_mm2, _ = neck.opening(rooms(radius_mm, tilt_deg))
        assert area_mm2 == pytest.approx(math.pi * radius_mm**2, rel=0.12)
        # another hole through the same wall is another way
        beside, _ = neck.opening(rooms(radius_mm, tilt_deg, beside_mm=1.5))
        assert beside == pytest.approx(area_mm2, rel=1e-6)
    # what was there before belongs to another room, and is not gained by joining it
    before = Neck.between(rooms(2.0, tilt_deg, beside_mm=1.5), START, END)
    joined, _ = before.opening(rooms(5.8, tilt_deg, beside_mm=1.5))
    assert joined < math.pi * 5.8**2 + 0.5


def places(head: Volume) -> tuple[Doubles, Doubles, Doubles]:
    matrix = head.world_from_voxel
    k, j, i = np.indices(head.shape)
    found = np.stack([i, j, k], axis=-1) @ matrix[:3, :3].T + matrix[:3, 3]
    return found[..., 0], found[..., 1], found[..., 2]


def test_a_groove_beside_the_hole_leads_nowhere() -> None:
    """Only what leads into the room behind widens its neck."""
    x, y, z = places(rooms(2.0))
    hole, wide = np.hypot(x, z) - 2.0, np.hypot(x, z) - 5.0
    wall = np.minimum(np.minimum(y + 0.5, 7.0 - y), hole)
    thick = rooms(2.0).with_values(wall.astype(np.float32), -5.0)
    neck = Neck.between(thick, START, np.array([0.0, 10.0, 0.0]))
    before_mm2, _ = neck.opening(thick)
    for deep_mm, area_mm2 in ((1.0, before_mm2), (20.0, math.pi * 25.0)):
        groove = np.maximum(wide, y - neck.middle[1] - deep_mm)
        values = np.minimum(wall, groove).astype(np.float32)
        found, _ = neck.opening(thick.with_values(values, -5.0))
        assert found == pytest.approx(area_mm2, rel=0.12)


@pytest.mark.parametrize("radius_mm", [2.0, 3.0, 4.5])
def test_small_bites_together_let_a_large_ball_pass(radius_mm: float) -> None:
    """A carved distance knows of one bite at a time."""
    shut = rooms(1.0)
    neck = Neck.between(shut, START, END)
    x, _, z = places(shut)
    values = shut.values
    for across, up in itertools.product(np.arange(-4.0, 4.1, 0.25), repeat=2):
        if math.hypot(across, up) <= radius_mm - 1.0:
            values = np.minimum(values, np.hypot(x - across, z - up) - 1.0)
    cut = shut.with_values(values.astype(np.float32), -5.0)
    assert neck.opening(cut)[1] == pytest.approx(radius_mm, abs=0.3)


def test_a_closed_neck_is_opened_where_it_was_closed() -> None:
    shut = rooms(-9.0)
    neck = Neck.between(shut, START, END)
    assert neck.opening(shut) == (0.0, 0.0)
    assert neck.opening(rooms(2.0))[0] == pytest.approx(math.pi * 4.0, rel=0.12)


def test_without_a_wall_the_whole_section_counts() -> None:
    air = rooms(2.0).with_values(np.full((49,) * 3, -5.0, np.float32), -5.0)
    area_mm2, passes_mm = Neck.between(air, START, END).opening(air)
    assert area_mm2 == pytest.approx((2 * WIDE_MM) ** 2, rel=0.05)
    assert passes_mm == pytest.approx(WIDE_MM, abs=0.4)
