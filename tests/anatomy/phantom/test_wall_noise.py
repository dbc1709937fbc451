import numpy as np
import pytest

from anatomy.kernels import stack_program as kernels
from anatomy.phantom.wall_noise import LIMITS_MM, noise_tables


def rows(points: np.ndarray, seed: int = 3, factor: float = 1.0) -> np.ndarray:
    octaves, limits, permutation, gradients, _ = noise_tables(seed, factor)
    out = np.empty((2, points.shape[1]), dtype=np.float32)
    kernels.noise_rows(
        points.astype(np.float32),
        points.shape[1],
        octaves,
        limits,
        permutation,
        gradients,
        out,
    )
    return out


POINTS = np.random.default_rng(0).uniform(-80, 60, (3, 40_000))


def test_unevenness_has_the_stated_strength_and_bounds() -> None:
    value = rows(POINTS)
    whole = np.sqrt(0.28**2 + 0.13**2 + 0.045**2)
    # The soft bound takes a little off the largest bumps.
    assert value[0].std() == pytest.approx(whole, rel=0.2)
    assert abs(float(value[0].mean())) < 0.03
    assert np.abs(value[0]).max() < LIMITS_MM[0]
    assert np.abs(value[1]).max() < LIMITS_MM[1]


def test_lymphoid_tissue_stays_at_the_rear() -> None:
    value = rows(POINTS)[1]
    front, rear = POINTS[1] > -64.9, POINTS[1] < -69.1
    assert np.all(value[front] == 0)
    assert value[rear].std() == pytest.approx(0.4, rel=0.2)


def test_the_field_is_smooth() -> None:
    step = 0.01
    for axis in range(3):
        moved = POINTS.copy()
        moved[axis] += step
        slope = (rows(moved)[0] - rows(POINTS)[0]) / step
        assert np.abs(slope).max() < 0.8


def grain(row: int, factor: float = 1.0) -> np.ndarray:
    _, _, permutation, gradients, octaves = noise_tables(3, factor)
    return np.array(
        [
            kernels.grain_at(a, b, c, row, octaves, permutation, gradients)
            for a, b, c in POINTS[:, :8000].T.astype(np.float32)
        ]
    )


@pytest.mark.parametrize("row", [0, 1])
def test_grain_of_bone_has_mean_zero_and_deviation_one(row: int) -> None:
    """So bone's mean density, and with it its mass, is what the walls' table says."""
    value = grain(row)
    assert value.mean() == pytest.approx(0.0, abs=0.06)
    assert value.std() == pytest.approx(1.0, abs=0.15)
    assert np.all(grain(row, 0.0) == 0)


def test_factor_zero_gives_smooth_walls_and_seeds_differ() -> None:
    assert np.all(rows(POINTS, factor=0.0) == 0)
    assert not np.array_equal(rows(POINTS, 1), rows(POINTS, 2))
