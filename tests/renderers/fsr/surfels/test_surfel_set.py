import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from renderers.fsr.surfels.surfel_set import Surfels, extract_surfels
from renderers.scene import Volume


def positions(surfels: Surfels) -> NDArray[np.float64]:
    return surfels.position + surfels.rows.world_from_voxel[:3, 3]


def ball(spacing: tuple[float, float, float], origin: float = 0.0) -> Volume:
    """Air inside a sphere of 6 mm around the grid's centre."""
    h = np.array(spacing)
    shape = tuple(int(16 / s) + 1 for s in h[::-1])
    k, j, i = np.indices(shape)
    p = np.stack([i, j, k], -1) * h - 8.0
    return Volume(
        (np.linalg.norm(p, axis=-1) - 6).astype(np.float32), h, np.full(3, origin)
    )


@pytest.mark.parametrize("refine", [1, 2])
def test_a_plane_is_met_exactly_and_covered_by_one_layer(refine: int) -> None:
    normal = np.array([0.48, -0.6, 0.64])
    k, j, i = np.indices((21, 21, 21))
    d = (np.stack([i, j, k], -1) * 0.5 - 5.1) @ normal
    volume = Volume(d.astype(np.float32), np.full(3, 0.5), np.zeros(3))
    surfels = extract_surfels(volume, refine)
    p = positions(surfels)
    inner = np.all((p > 1) & (p < 9), axis=1)
    np.testing.assert_allclose((p[inner] - 5.1) @ normal, 0, atol=2e-6)
    np.testing.assert_allclose(
        surfels.normal[inner], np.broadcast_to(-normal, (inner.sum(), 3)), atol=2e-5
    )
    # one element per squared spacing of the plane: a layer one spacing thick
    area = np.sum(np.linalg.norm(p - 5.1, axis=1) < 3) * (0.5 / refine) ** 2
    assert area == pytest.approx(9 * np.pi, rel=0.1)


@pytest.mark.parametrize(
    ("spacing", "off_mm"), [((0.5, 0.5, 0.5), 0.02), ((0.4, 0.6, 1.0), 0.06)]
)
def test_a_sphere_is_met_within_the_error_of_its_trilinear_field(
    spacing: tuple[float, float, float], off_mm: float
) -> None:
    volume = ball(spacing)
    surfels = extract_surfels(volume, 2)
    p = positions(surfels)
    radial = p - 8.0
    r = np.linalg.norm(radial, axis=1)
    assert np.abs(r - 6).max() < off_mm
    # the elements sit where the trilinear field, not the sphere, is zero
    assert np.abs(volume.sample(p)).max() < 1e-4
    inward = -(radial * surfels.normal).sum(axis=1) / r
    assert np.degrees(np.arccos(np.clip(inward, -1, 1))).mean() < 1.0


def test_far_from_the_origin_nothing_is_lost() -> None:
    near, far = (
        extract_surfels(ball((0.5,) * 3)),
        extract_surfels(ball((0.5,) * 3, 1e6)),
    )
    np.testing.assert_array_equal(near.position, far.position)


def test_a_field_without_a_zero_has_no_surfels() -> None:
    volume = Volume(np.full((5, 5, 5), 3.0, np.float32), np.ones(3), np.zeros(3))
    assert len(extract_surfels(volume)) == 0


def test_refinement_must_be_positive() -> None:
    with pytest.raises(ValueError, match="at least 1"):
        extract_surfels(ball((0.5,) * 3), 0)


@pytest.mark.parametrize("refine", [1, 2])
@pytest.mark.parametrize("width_mm", [0.8, 1.0, 1.4])
def test_both_walls_of_a_narrow_cleft_are_covered(refine: int, width_mm: float) -> None:
    """Also where the cell in the cleft's middle has no slope of its own."""
    rng = np.random.default_rng(3)
    k, j, i = np.indices((33, 33, 33))
    grid = np.stack([i, j, k], -1) * 0.5 - 8
    for _ in range(6):
        across = rng.normal(size=3)
        across /= np.linalg.norm(across)
        shift = rng.uniform(-0.3, 0.3)
        d = np.abs(grid @ across - shift) - width_mm / 2
        volume = Volume(d.astype(np.float32), np.full(3, 0.5), np.full(3, -8.0))
        surfels = extract_surfels(volume, refine)
        p = positions(surfels)
        anywhere = rng.uniform(-5, 5, (2000, 3))
        for side in (-1, 1):
            off = anywhere @ across - shift - side * width_mm / 2
            wall = anywhere - off[:, None] * across
            wall = wall[np.all(np.abs(wall) < 5, axis=1)]
            own = surfels.normal @ (-side * across) > 0.5
            distance, _ = cKDTree(p[own]).query(wall)
            # what hides is the core of a disc, 1.02 spacings in radius
            assert distance.max() < 0.95 * 0.5 / refine
