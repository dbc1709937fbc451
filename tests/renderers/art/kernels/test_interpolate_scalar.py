import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from renderers.art.kernels.interpolate_scalar import SHORT, trilinear

N = 3


@given(
    fraction=st.tuples(*[st.floats(0, 1, width=32)] * 3),
    seed=st.integers(0, 99),
    whole=st.booleans(),
)
def test_between_voxels(
    fraction: tuple[float, float, float], seed: int, whole: bool
) -> None:
    rng = np.random.default_rng(seed)
    values = rng.integers(-32767, 32768, (N, N, N, 4))
    samples = values.astype(np.int16 if whole else np.float32).ravel()
    fx, fy, fz = fraction
    weight = [np.array([1 - f, f]) for f in (fz, fy, fx)]
    for channel in range(4):
        cube = values[1:, 1:, 1:, channel]
        exact = np.einsum("zyx,z,y,x", cube.astype(float), *weight)
        at = 4 * (N * N + N + 1) + channel
        found = trilinear(
            samples, at, 4, 4 * N, 4 * N * N, *(np.float32(f) for f in fraction)
        )
        alone = np.ascontiguousarray(samples[channel::4])
        place = N * N + N + 1
        assert found == trilinear(
            alone, place, 1, N, N * N, *(np.float32(f) for f in fraction)
        )
        # Whole numbers: y is rounded to 1 / 32767 of a voxel.
        most = 2e-2 + (65534 / 32767 / 2 * 1.1 if whole else 0)
        assert found / (SHORT if whole else 1) == pytest.approx(exact, abs=most)
