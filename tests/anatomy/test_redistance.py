import numpy as np
import pytest
from scipy import ndimage

from anatomy.kernels import sweep_distance as kernels
from anatomy.redistance import DEEPEST_MM, FARTHEST_MM, redistance


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


def plain(field: np.ndarray, h: float) -> np.ndarray:
    """Sweep every voxel every time, in the kernel's order and precision."""
    f = np.float32
    deep, step = f(-DEEPEST_MM), f(h)
    state = np.zeros(field.shape, dtype=np.uint8)
    d = np.empty(field.shape, dtype=np.float32)
    rows = np.zeros((2, *field.shape[:2]), dtype=np.uint8)
    kernels.start_values(field, step, deep, f(FARTHEST_MM), d, state, rows)
    nz, ny, nx = field.shape
    for order in range(16):
        for z in range(nz)[:: 1 if order & 1 else -1]:
            for y in range(ny)[:: 1 if order & 2 else -1]:
                for x in range(nx)[:: 1 if order & 4 else -1]:
                    if state[z, y, x] == kernels.FIXED:
                        continue
                    a, b, c = sorted(
                        (
                            min(d[max(z - 1, 0), y, x], d[min(z + 1, nz - 1), y, x]),
                            min(d[z, max(y - 1, 0), x], d[z, min(y + 1, ny - 1), x]),
                            min(d[z, y, max(x - 1, 0)], d[z, y, min(x + 1, nx - 1)]),
                        )
                    )
                    if a + step * f(0.577) >= d[z, y, x]:
                        continue
                    t = a + step
                    if t > b:
                        q = f(2) * step * step - (a - b) * (a - b)
                        t = (a + b + np.sqrt(q)) / f(2)
                        if t > c:
                            s = a + b + c
                            q = s * s - f(3) * (a * a + b * b + c * c - step * step)
                            t = (s + np.sqrt(max(q, f(0)))) / f(3)
                    if t < d[z, y, x]:
                        d[z, y, x] = min(t, deep)
    d = np.where(field < 0, -d, np.minimum(d, f(FARTHEST_MM)))
    return d


@pytest.mark.parametrize("threads", [1, 2])
def test_voxels_that_sleep_lose_no_bit(threads: int) -> None:
    rng = np.random.default_rng(3)
    rough = ndimage.gaussian_filter(rng.normal(size=(13, 17, 15)), 3.0)
    field = (40 * rough + 0.4).astype(np.float32)
    assert 50 < np.count_nonzero(field < 0) < field.size - 50
    assert np.array_equal(redistance(field, 0.7, threads), plain(field, 0.7))


def test_a_field_without_a_surface_is_far_from_it() -> None:
    ones = np.ones((4, 5, 6), dtype=np.float32)
    assert np.all(redistance(ones, 1.0) == FARTHEST_MM)
    assert np.all(redistance(-ones, 1.0) == DEEPEST_MM)


def test_a_flat_array_is_refused() -> None:
    with pytest.raises(ValueError, match="3-D field"):
        redistance(np.ones((3, 3), dtype=np.float32), 1.0)
