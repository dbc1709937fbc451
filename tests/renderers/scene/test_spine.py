import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal
from numpy.typing import NDArray

from renderers.scene import Mesh, Spine
from scenarios.instruments import suction_tube

Doubles = NDArray[np.float64]


def rod_distance(spine: Spine, points: Doubles) -> Doubles:
    """Distance of points from the rods' round surfaces, negative inside."""
    axis = spine.end_mm - spine.start_mm
    length = np.linalg.norm(axis, axis=1)
    axis = axis / length[:, None]
    off = points[:, None] - spine.start_mm
    along = np.clip((off * axis).sum(axis=2), 0, length)
    apart = np.linalg.norm(off - along[..., None] * axis, axis=2)
    result: Doubles = (apart - spine.radius_mm).min(axis=1)
    return result


def cylinder(radius: float, length: float, sides: int = 48) -> Mesh:
    """An open cylinder about z, from 0 to `length`."""
    turn = np.arange(sides) * (2 * math.pi / sides)
    ring = radius * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    low = np.column_stack([ring, np.zeros(sides)])
    high = np.column_stack([ring, np.full(sides, length)])
    i = np.arange(sides)
    j = (i + 1) % sides
    faces = np.concatenate(
        [np.stack([i, j, sides + j], 1), np.stack([i, sides + j, sides + i], 1)]
    )
    return Mesh(np.concatenate([low, high]), faces.astype(np.int32))


@given(st.floats(0.3, 2.0), st.floats(15, 60))
def test_a_cylinder_is_one_rod(radius: float, length: float) -> None:
    spine = cylinder(radius, length).spine(np.eye(4))
    assert len(spine.radius_mm) == 1
    assert spine.radius_mm[0] == pytest.approx(radius, rel=0.02)
    heights = sorted([spine.start_mm[0, 2], spine.end_mm[0, 2]])
    # slices of a surface cut into pieces: their ends are known to half a piece
    assert heights == pytest.approx([0, length], abs=0.5)
    assert np.abs(spine.start_mm[0, :2]).max() < 0.05
    assert spine.is_free.all()


def test_a_bent_tube_lies_along_its_rods() -> None:
    tube = suction_tube()
    spine = tube.spine(np.eye(4))
    assert len(spine.radius_mm) < 12
    outside = np.hypot(tube.vertices[:, 0], tube.vertices[:, 1]) > 1.19
    straight = outside & (tube.vertices[:, 2] < 70)
    assert np.abs(rod_distance(spine, tube.vertices[straight])).max() < 0.1
    assert rod_distance(spine, tube.vertices).max() < 0.35
    # where two rods meet, no end is free
    assert spine.is_free.sum() == 2
    assert_array_equal(spine.start_mm[1:], spine.end_mm[:-1])


def test_rods_move_with_the_mesh() -> None:
    tube = suction_tube()
    turn = math.radians(40)
    pose = np.eye(4)
    pose[:2, :2] = [[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]]
    pose[:3, 3] = [3, -5, 9]
    still, moved = tube.spine(np.eye(4)), tube.spine(pose)
    np.testing.assert_allclose(
        moved.start_mm, still.start_mm @ pose[:3, :3].T + pose[:3, 3], atol=1e-9
    )
    assert_array_equal(moved.radius_mm, still.radius_mm)


def test_a_mesh_loaded_again_has_the_same_rods_to_the_bit() -> None:
    tube = suction_tube()
    again = Mesh(tube.vertices.copy(), tube.faces.copy(), tube.material)
    a, b = tube.spine(np.eye(4)), again.spine(np.eye(4))
    assert_array_equal(a.start_mm, b.start_mm)
    assert_array_equal(a.radius_mm, b.radius_mm)


def test_a_mesh_that_says_its_rods_has_them_and_no_others() -> None:
    ring = np.array([[1.0, 0, 0, 0, 1, 0, 0.2], [0, 1, 0, -1, 0, 0, 0.3]])
    plate = Mesh(np.eye(3), np.array([[0, 1, 2]]), capsules=ring)
    pose = np.eye(4)
    pose[:3, 3] = [3, -5, 9]
    spine = plate.spine(pose)
    assert_array_equal(spine.start_mm, ring[:, :3] + pose[:3, 3])
    assert_array_equal(spine.end_mm, ring[:, 3:6] + pose[:3, 3])
    assert_array_equal(spine.radius_mm, ring[:, 6])
    assert not spine.is_free.any()


@pytest.mark.parametrize(
    ("capsules", "message"),
    [
        (np.zeros((0, 7)), r"must be \(k, 7\)"),
        (np.ones((2, 6)), r"must be \(k, 7\)"),
        (np.zeros((1, 7)), "radii positive"),
        (np.full((1, 7), np.nan), "must be finite"),
    ],
)
def test_bad_rods_are_refused(capsules: Doubles, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Mesh(np.eye(3), np.array([[0, 1, 2]]), capsules=capsules)
