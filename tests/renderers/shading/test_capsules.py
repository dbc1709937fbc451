import numpy as np
import pytest
from numpy.typing import NDArray

from renderers.scene import Camera, Material, Spine
from renderers.shading import Caster
from renderers.shading.capsules import COLUMNS, capsule_table

CAMERA = Camera.looking_at([5.0, -3, 2], [5.0, 10, 2])


def capsule(start: list[float], end: list[float], radius: float = 1.0) -> Spine:
    """One capsule, given in the camera's axes (right, up, forward) from its eye."""
    frame = CAMERA.frame
    points: NDArray[np.float64] = np.array([start, end]) @ frame[1:] + frame[0]
    return Spine(points[:1], points[1:], np.array([radius]), np.ones((1, 2), np.bool_))


def test_no_tool_is_no_row() -> None:
    assert capsule_table((), CAMERA).shape == (0, COLUMNS)


def test_a_capsule_before_the_lens_is_taken_whole() -> None:
    (row,) = capsule_table([Caster(capsule([1, 0, 2], [1, 0, 12], 0.7))], CAMERA)
    np.testing.assert_allclose(row[:3] @ CAMERA.frame[1:].T, [1, 0, 2], atol=1e-6)
    np.testing.assert_allclose(row[3:6] @ CAMERA.frame[1:].T, [0, 0, 1], atol=1e-6)
    np.testing.assert_allclose(row[6:10], [10, 0.7, 1, 1], rtol=1e-6)


def test_a_capsule_is_cut_at_the_plane_of_the_fibres() -> None:
    for start, end in ((-30.0, 10.0), (10.0, -30.0)):
        spine = capsule([1, 0, start], [1, 0, end])
        (row,) = capsule_table([Caster(spine)], CAMERA)
        assert row[6] == pytest.approx(10)
        # the cut is no end of the tool
        assert sorted(row[8:10]) == [0, 1]


def test_what_is_all_behind_casts_nothing() -> None:
    assert not len(capsule_table([Caster(capsule([1, 0, -30], [1, 0, -1]))], CAMERA))


def test_what_the_lens_is_in_casts_nothing() -> None:
    for away in (0.9, 1.1):
        spine = capsule([away, 0, -5], [away, 0, 9], 1.0)
        assert len(capsule_table([Caster(spine)], CAMERA)) == (away > 1.0)


def test_black_plastic_takes_more_of_the_light_than_steel() -> None:
    spine = capsule([1, 0, 2], [1, 0, 12])
    steel, black = (
        capsule_table([Caster(spine, material)], CAMERA)[0, 10]
        for material in (Material.METAL, Material.DARK_PLASTIC)
    )
    assert 0 < steel < 0.5 < 0.9 < black < 1
