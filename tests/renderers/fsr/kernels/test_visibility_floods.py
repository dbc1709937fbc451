import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from renderers.fsr.visibility.floods import BoxFlood, find_air
from renderers.scene import Volume

EDGE = 4


def caves(seed: int, shape: tuple[int, int, int] = (29, 23, 70)) -> Volume:
    """Winding air: no true distance, which the floods do not need."""
    noise = np.random.default_rng(seed).normal(size=shape)
    field = gaussian_filter(noise, 2.0)
    field = field / field.std() + 0.4
    return Volume(field.astype(np.float32), np.ones(3), np.zeros(3))


def cells_of(seen: NDArray[np.uint64], across: int) -> NDArray[np.bool_]:
    bits = np.unpackbits(seen.view(np.uint8), axis=2, bitorder="little")
    return np.asarray(bits[:, :, :across] > 0)


@settings(max_examples=10)
@given(seed=st.integers(0, 10_000))
def test_every_cell_on_a_free_line_from_the_box_is_seen(seed: int) -> None:
    volume = caves(seed)
    rng = np.random.default_rng(seed)
    nz, ny, nx = volume.shape
    air = np.argwhere(volume.values < 0)
    corner = air[rng.integers(len(air))] // EDGE * EDGE
    low = np.minimum(corner, np.array(volume.shape) - 2)[::-1]
    seen = cells_of(BoxFlood(find_air(volume), EDGE).seen(low), nx - 1)
    eyes = low + rng.uniform(0, EDGE, (200, 3))
    ways = rng.normal(size=(200, 3))
    # lines along axes and diagonals of the grid are where floods have their edges
    ways[:60] = rng.integers(-1, 2, (60, 3)) + 1e-3 * rng.normal(size=(60, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    points = eyes[:, None] + np.arange(0, 80, 0.05)[:, None] * ways[:, None]
    inside = np.all((points >= 0) & (points < np.array([nx, ny, nz]) - 1), axis=-1)
    field = np.where(inside, volume.sample(points), 1.0)
    free = np.logical_and.accumulate(field < 0, axis=1)
    i, j, k = np.floor(points[free]).astype(int).T
    assert np.all(seen[k, j, i])


def test_a_wall_one_cell_thick_hides_what_is_behind_it() -> None:
    values = np.full((20, 20, 40), -1.0, np.float32)
    # two points deep, so that one layer of cells is all tissue
    values[:, :, 17:19] = 1.0
    volume = Volume(values, np.ones(3), np.zeros(3))
    seen = cells_of(BoxFlood(find_air(volume), EDGE).seen(np.array([4, 8, 8])), 39)
    assert seen[:, :, :17].all()
    assert not seen[:, :, 17:].any()


def test_through_a_hole_only_a_cone_is_seen() -> None:
    values = np.full((41, 41, 61), -1.0, np.float32)
    values[:, :, 20:24] = 1.0
    values[18:23, 18:23, 20:24] = -1.0
    volume = Volume(values, np.ones(3), np.zeros(3))
    seen = cells_of(BoxFlood(find_air(volume), EDGE).seen(np.array([4, 18, 18])), 60)
    assert seen[18:22, 18:22, 59].all()
    # straight lines reach a square of about 10 cells; within a beam lines may bend
    behind = seen[:, :, 30]
    assert behind[16:24, 16:24].all()
    assert behind.sum() < 27**2
    assert not seen[2, 2, 30]


def test_large_grids_are_flooded_in_more_beams() -> None:
    volume = Volume(np.full((4, 4, 500), -1, np.float32), np.ones(3), np.zeros(3))
    lookout = BoxFlood(find_air(volume), EDGE)
    assert lookout.beams >= 2 * 499 / 56
    assert cells_of(lookout.seen(np.array([0, 0, 0])), 499).all()
    assert cells_of(lookout.seen(np.array([496, 0, 0])), 499).all()


def test_boxes_wider_than_a_word_are_refused() -> None:
    with pytest.raises(ValueError, match="up to 52 cells, got 60"):
        BoxFlood(find_air(caves(0)), 60)
