import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from renderers.fsr.kernels.project_splats import Splats
from renderers.fsr.kernels.subdivide import SPLITS, subdivide
from tests.renderers.fsr.splat_scenes import view_from

VIEW = view_from(np.zeros(3))


@given(seed=st.integers(0, 10**6), count=st.integers(0, 40), splits=st.integers(0, 3))
def test_parts_keep_mass_and_middle_and_are_small_enough(
    seed: int, count: int, splits: int
) -> None:
    """Seen from the origin; each part is as far as its size asks, or the smallest."""
    rng = np.random.default_rng(seed)
    places = rng.uniform(-9, 9, (count + 5, 4)).astype(np.float32)
    colors = rng.uniform(0.1, 1, (count + 5, 4)).astype(np.float32)
    # by its colour each part is known
    colors[:, 0] = np.arange(count + 5)
    index = rng.permutation(count + 5)[:count].astype(np.int32)
    (found, colours), cut, depths = subdivide(
        index, Splats(places, colors), VIEW, np.float32(8.0), np.float32(0.5**splits)
    )
    depth = np.linalg.norm(found[:, :3], axis=1)
    whole = colours[:, 0].astype(int)
    size = colours[:, 3] / colors[whole, 3]
    assert np.all((depth > 7.999 * size) | (size < 1.001 * 0.5**splits))
    for s in index:
        parts = found[whole == s]
        np.testing.assert_allclose(parts[:, 3].sum(), places[s, 3], rtol=1e-5)
        middle = np.average(parts[:, :3], axis=0, weights=parts[:, 3])
        np.testing.assert_allclose(middle, places[s, :3], atol=1e-4)
        steps = np.abs(parts[:, :3] - places[s, :3])
        assert np.all(steps <= 0.5 - 0.5 * size[whole == s][:, None] + 1e-5)
    assert len(found) == count + 7 * cut
    np.testing.assert_array_equal(colours[:, 1:3], colors[whole, 1:3])
    np.testing.assert_allclose(depths, depth, rtol=1e-5)


def test_there_is_room_for_all_parts() -> None:
    """As many as there can be: 512 of each splat, in the splats' order."""
    count = 5
    places = np.zeros((count, 4), np.float32)
    places[:, 0] = 10 * np.arange(count)
    places[:, 3] = 1
    splats = Splats(places, np.ones((count, 4), np.float32))
    index = np.arange(count, dtype=np.int32)
    (found, colours), cut, depths = subdivide(
        index, splats, VIEW, np.float32(1e9), np.float32(0.5**SPLITS)
    )
    assert len(found) == len(colours) == len(depths) == count * 8**SPLITS
    assert cut == count * (1 + 8 + 64)
    whole = np.repeat(np.arange(count), 8**SPLITS)
    np.testing.assert_array_equal(np.rint(found[:, 0] / 10), whole)
    assert len(np.unique(found[:, :3], axis=0)) == len(found)
