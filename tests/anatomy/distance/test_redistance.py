import numpy as np
import pytest

from anatomy.distance.redistance import DEEPEST_MM, FARTHEST_MM, redistance


def grid(spacing_mm: float, half_mm: float = 12.0) -> np.ndarray:
    axis = np.arange(-half_mm, half_mm + 1e-9, spacing_mm)
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij")
    return np.stack([x, y, z])


def test_an_oblique_plane_is_exact_next_to_it_whatever_the_fields_slope() -> None:
    normal = np.array([1.0, 2.0, 2.0]) / 3
    exact = np.tensordot(normal, grid(0.5, 6.0), 1) + 0.13
    found = redistance((2.7 * exact).astype(np.float32), 0.5)
    inner = found[3:-3, 3:-3, 3:-3]
    truth = exact[3:-3, 3:-3, 3:-3]
    start = np.abs(truth) < 0.17
    assert np.abs(inner - truth)[start].max() < 1e-5
    assert np.abs(inner - truth)[np.abs(truth) < 3].max() < 0.2


def test_a_sphere_converges_and_keeps_unit_gradient() -> None:
    errors = []
    for spacing in (1.0, 0.5):
        points = grid(spacing)
        exact = 7.0 - np.linalg.norm(points, axis=0)
        found = redistance((exact * 1.8).astype(np.float32), spacing)
        band = (np.abs(exact) < 3.0) & (np.abs(points).max(axis=0) < 11)
        errors.append(float(np.abs(found - exact)[band].mean()))
    assert errors[1] < 0.6 * errors[0]
    assert errors[1] < 0.06  # 0.049
    slope = np.linalg.norm(np.gradient(found, 0.5), axis=0)[np.abs(exact) < 1.0]
    low, high = np.percentile(slope, [1, 99])
    assert low > 0.9  # 0.94
    assert high < 1.16  # 1.146: first order


def test_signs_are_kept_and_values_are_bounded() -> None:
    field = np.random.default_rng(0).normal(size=(20, 21, 22)).astype(np.float32)
    field[5, 5, 5] = 0.0
    found = redistance(field, 0.7)
    assert np.array_equal(found < 0, field < 0)
    assert np.all((found >= DEEPEST_MM) & (found <= FARTHEST_MM))
    assert np.all(np.isfinite(found))


def test_a_field_without_a_surface_is_far_from_it() -> None:
    ones = np.ones((4, 5, 6), dtype=np.float32)
    assert np.all(redistance(ones, 1.0) == FARTHEST_MM)
    assert np.all(redistance(-ones, 1.0) == DEEPEST_MM)


def test_a_flat_array_is_refused() -> None:
    with pytest.raises(ValueError, match="3-D field"):
        redistance(np.ones((3, 3), dtype=np.float32), 1.0)
