import numpy as np

from renderers.fsr.classic.near import split


def test_parts_keep_mass_and_middle_and_form_the_half_lattice() -> None:
    rng = np.random.default_rng(1)
    places = rng.integers(0, 9, (5, 4)).astype(np.float32)
    parts = split(places, 1.0).reshape(5, 8, 4)
    np.testing.assert_allclose(parts[..., 3].sum(1), places[:, 3])
    np.testing.assert_allclose(parts[..., :3].mean(1), places[:, :3])
    assert np.all(np.abs(parts[..., :3] - places[:, None, :3]) == 0.25)
    again = split(split(places, 1.0), 0.5)
    assert len(np.unique(again[:, :3] * 8 % 2)) == 1
