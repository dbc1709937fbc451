import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from renderers.shading.kernels.camera_meter import find_gain

TARGET, MOST = 0.17, 1e5


@given(seed=st.integers(0, 1000), spread=st.floats(0.1, 3))
def test_the_gain_brings_the_clipped_mean_to_the_target(
    seed: int, spread: float
) -> None:
    rng = np.random.default_rng(seed)
    luminance = rng.lognormal(-4, spread, 300).astype(np.float32)
    weight = rng.random(300).astype(np.float32)
    weight /= weight.sum()
    gain = find_gain(luminance, weight, TARGET, MOST, 50)
    mean = np.minimum(gain * luminance.astype(np.float64), 1) @ weight
    assert mean == pytest.approx(TARGET, rel=1e-6)
