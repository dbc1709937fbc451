import numpy as np
import pytest
from numpy.typing import NDArray

from renderers.fsr.sobel_normals import decode_normals, gradient_volume
from renderers.scene import Volume


def rotation(seed: int) -> NDArray[np.float64]:
    q, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    return np.asarray(q * np.sign(np.linalg.det(q)))


def sobel_twin(volume: Volume) -> NDArray[np.float64]:
    """Correlate by shifted sums over an edge-padded copy, axis by axis."""
    f = np.pad(volume.values.astype(np.float64), 1, mode="edge")
    result = np.empty((*volume.shape, 3))
    for axis in range(3):
        g = f
        for other in range(3):
            n = g.shape[other] - 2
            low, mid, high = (
                np.take(g, range(o, o + n), axis=other) for o in (0, 1, 2)
            )
            g = high - low if other == axis else low + 2 * mid + high
        result[..., 2 - axis] = g / (32 * volume.spacing_mm[2 - axis])
    return result @ volume.direction.T


def test_gradient_of_a_linear_field_is_exact_for_any_spacing_and_direction() -> None:
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
    inner = gradient_volume(volume)[1:-1, 1:-1, 1:-1]
    np.testing.assert_allclose(inner, np.broadcast_to(slope, inner.shape), atol=2e-4)


def test_gradient_equals_the_plain_twin_up_to_the_border() -> None:
    values = np.random.default_rng(2).normal(size=(6, 5, 7)).astype(np.float32)
    volume = Volume(values, np.array([0.5, 0.7, 1.1]), np.zeros(3), rotation(3))
    np.testing.assert_allclose(gradient_volume(volume), sobel_twin(volume), atol=1e-5)


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
    g = -gradient_volume(volume)[shell]
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
