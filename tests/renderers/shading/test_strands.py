import numpy as np
import pytest
from numpy.testing import assert_array_equal
from scipy.spatial.distance import pdist

from renderers.scene import AirSurface
from renderers.shading.strands import (
    LEAST_SKIN,
    LENGTH_MM,
    POINTS,
    RADIUS_MM,
    SPACING_MM,
    TIP_SHARE,
    Strands,
)


@pytest.fixture(scope="module")
def strands(surface: AirSurface) -> Strands:
    return Strands.grow(surface, 7)


def test_the_same_seed_grows_the_same_hairs(
    surface: AirSurface, strands: Strands
) -> None:
    again = Strands.grow(surface, 7)
    assert_array_equal(again.points_mm, strands.points_mm)
    other = Strands.grow(surface, 8)
    assert not np.array_equal(other.points_mm[:1], strands.points_mm[:1])


def test_hairs_grow_on_skin_and_nowhere_else(
    surface: AirSurface, strands: Strands
) -> None:
    roots = strands.points_mm[:, 0]
    assert len(roots) > 10
    assert np.abs(surface.distance.sample(roots)).max() < 0.1
    # a root lies within a voxel of one that is skin
    assert surface.skin.sample(roots).min() > 255 * LEAST_SKIN - 255 * 0.5 / 3
    bare = AirSurface(
        surface.distance,
        surface.blood,
        surface.skin.with_values(np.zeros_like(surface.skin.values), 0),
    )
    assert not len(Strands.grow(bare, 7).points_mm)


def test_roots_keep_apart(strands: Strands) -> None:
    # roots are moved from voxels to the surface after they are chosen
    assert pdist(strands.points_mm[:, 0]).min() > SPACING_MM - 1.0


def test_hairs_stay_in_the_air(surface: AirSurface, strands: Strands) -> None:
    beyond_root = strands.points_mm[:, 2:]
    assert surface.distance.sample(beyond_root).max() < 0.02


def test_hairs_have_a_length_and_taper(strands: Strands) -> None:
    steps = np.linalg.norm(np.diff(strands.points_mm, axis=1), axis=2)
    length = steps.sum(axis=1)
    assert length.max() <= LENGTH_MM[1] * 1.0001
    # most are not cut short by a wall
    assert np.median(length) > LENGTH_MM[0]
    assert strands.radius_mm.shape == (len(length), POINTS)
    np.testing.assert_allclose(strands.radius_mm[:, 0], RADIUS_MM)
    np.testing.assert_allclose(strands.radius_mm[:, -1], RADIUS_MM * TIP_SHARE)


def test_a_face_without_another_wall_is_bare(surface: AirSurface) -> None:
    # a plane of skin under open air
    nz = surface.distance.shape[0]
    height = (np.arange(nz) - nz / 2) * surface.distance.spacing_mm[2]
    plane = np.broadcast_to(-height[:, None, None], surface.distance.shape)
    skin = np.full(surface.distance.shape, 255, np.uint8)
    open_air = AirSurface(
        surface.distance.with_values(plane.astype(np.float32), -1.0),
        surface.blood,
        surface.skin.with_values(skin, 0),
    )
    assert not len(Strands.grow(open_air, 7).points_mm)
