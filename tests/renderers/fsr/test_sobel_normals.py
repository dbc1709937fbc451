import numpy as np
import pytest
from numpy.typing import NDArray

from renderers.fsr import Inclusion, extract_fuzzy_set
from renderers.fsr.sobel_normals import decode_normals
from renderers.scene import Volume


def rotation(seed: int) -> NDArray[np.float64]:
    q, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    return np.asarray(q * np.sign(np.linalg.det(q)))


def normals_of(volume: Volume) -> NDArray[np.float64]:
    """Return the normals that extraction finds, of all voxels."""
    low, high = volume.value_range
    whole = extract_fuzzy_set(volume, Inclusion.density(low, high + 1), low)
    return whole.normals().reshape(*volume.shape, 3).astype(np.float64)


def test_the_normal_of_a_linear_field_is_exact_for_any_spacing_and_direction() -> None:
    slope = np.array([3.0, -2.0, 5.0])
    direction = rotation(1)
    grid = Volume(
        np.zeros((7, 8, 9), np.float32),
        np.array([0.4, 1.0, 2.0]),
        np.array([5.0, 6.0, 7.0]),
        direction,
    )
    k, j, i = np.indices(grid.shape)
    points = np.stack([i, j, k], -1) @ grid.world_from_voxel[:3, :3].T
    volume = grid.with_values((points @ slope).astype(np.float32), 0.0)
    inner = normals_of(volume)[1:-1, 1:-1, 1:-1]
    wanted = -slope / np.linalg.norm(slope)
    # packed into two times sixteen bits
    np.testing.assert_allclose(inner, np.broadcast_to(wanted, inner.shape), atol=2e-4)


@pytest.mark.parametrize("spacing", [(1.0, 1.0, 1.0), (1.0, 1.0, 5.0)])
def test_normals_of_a_soft_sphere_are_within_two_degrees(
    spacing: tuple[float, float, float],
) -> None:
    h = np.array(spacing)
    shape = tuple(int(60 / s) + 1 for s in h[::-1])
    k, j, i = np.indices(shape)
    p = np.stack([i, j, k], -1) * h - 30.0
    r = np.linalg.norm(p, axis=-1)
    volume = Volume(np.tanh((20 - r) / h.max()).astype(np.float32), h, np.zeros(3))
    shell = np.abs(r - 20) < 1
    g = normals_of(volume)[shell]
    truth = p[shell]
    cross = np.linalg.norm(np.cross(g, truth), axis=-1)
    angle = np.degrees(np.arctan2(cross, (g * truth).sum(-1)))
    assert angle.mean() < 2.0


def test_octahedral_decoding_gives_unit_vectors_and_zero_where_undefined() -> None:
    rng = np.random.default_rng(4)
    uv = rng.integers(-32767, 32768, size=(500, 2)).astype(np.int16)
    uv[0] = -32768
    normal = decode_normals(uv)
    assert not normal[0].any()
    np.testing.assert_allclose(np.linalg.norm(normal[1:], axis=1), 1, atol=1e-6)
