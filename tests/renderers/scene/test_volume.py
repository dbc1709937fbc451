"""Laws of the grid in the patient's frame."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from renderers.scene import AIR_HU, Volume

SEEDS = st.integers(0, 10**6)


def placed(
    values: NDArray[Any], seed: int, mirrored: bool = False, background: float = AIR_HU
) -> Volume:
    """Put values on a rotated (or mirrored), shifted, anisotropic grid."""
    rng = np.random.default_rng(seed)
    direction = Rotation.random(random_state=seed).as_matrix()
    if mirrored:
        direction[:, 1] *= -1
    return Volume(
        values, rng.uniform(0.2, 3, 3), rng.uniform(-200, 200, 3), direction, background
    )


def world(volume: Volume, voxel: NDArray[np.float64]) -> NDArray[np.float64]:
    matrix = volume.world_from_voxel
    return voxel @ matrix[:3, :3].T + matrix[:3, 3]


@given(seed=SEEDS, mirrored=st.booleans())
def test_world_and_voxel_transforms_are_inverse(seed: int, mirrored: bool) -> None:
    volume = placed(np.zeros((4, 5, 6)), seed, mirrored)
    product = volume.voxel_from_world @ volume.world_from_voxel
    np.testing.assert_allclose(product, np.eye(4), atol=1e-10)
    columns = volume.world_from_voxel[:3, :3]
    np.testing.assert_allclose(np.linalg.norm(columns, axis=0), volume.spacing_mm)


@given(seed=SEEDS, mirrored=st.booleans())
def test_trilinear_functions_are_reproduced_exactly(seed: int, mirrored: bool) -> None:
    rng = np.random.default_rng(seed)
    c = rng.uniform(-1, 1, (2, 2, 2))

    def f(x: Any, y: Any, z: Any) -> Any:
        # every monomial x^a y^b z^c with exponents 0 or 1, so that a swapped axis shows
        return sum(
            c[i, j, k] * x**i * y**j * z**k
            for i in (0, 1)
            for j in (0, 1)
            for k in (0, 1)
        )

    z, y, x = np.meshgrid(np.arange(4), np.arange(5), np.arange(6), indexing="ij")
    volume = placed(f(x, y, z), seed, mirrored)
    voxel = rng.uniform(0.001, [4.999, 3.999, 2.999], (50, 3))
    np.testing.assert_allclose(
        volume.sample(world(volume, voxel)), f(*voxel.T), atol=1e-9
    )


def test_voxel_centres_give_the_voxels_and_the_box_ends_there() -> None:
    values = np.random.default_rng(1).integers(-1000, 3000, (3, 4, 5)).astype(np.int16)
    volume = Volume(values, np.array([0.5, 0.25, 2]), np.array([8.0, -16, 32]))
    k, j, i = np.meshgrid(np.arange(3), np.arange(4), np.arange(5), indexing="ij")
    centers = world(volume, np.stack([i, j, k], axis=-1).astype(float))
    assert np.array_equal(volume.sample(centers), values)
    for axis in range(3):
        for end, step in ((0, -1e-3), (values.shape[2 - axis] - 1, 1e-3)):
            voxel = np.ones(3)
            voxel[axis] = end + step
            assert volume.sample(world(volume, voxel)) == AIR_HU


def test_outside_is_background_even_far_away() -> None:
    volume = placed(np.zeros((3, 3, 3)), seed=5, background=-3.5)
    far = np.array([[1e6, 0, 0], [0, -1e300, 0], [np.nan, 0, 0], [np.inf, 0, 0]])
    with np.errstate(invalid="ignore", over="ignore"):
        assert np.all(volume.sample(far) == -3.5)


@pytest.mark.parametrize("kind", ["u1", "<i2", ">i2", "<f4", ">f4", "f2", "f8", "u8"])
def test_all_kinds_of_numbers_are_read_alike(kind: str) -> None:
    rng = np.random.default_rng(4)
    exact = rng.integers(0, 200, (5, 4, 6)).astype(np.float64)
    points = rng.uniform(-1.0, 6.0, (40, 3))
    volume, same = (
        Volume(each, np.array([0.5, 0.7, 0.9]), np.array([1.0, 0.5, -0.3]))
        for each in (exact.astype(kind), exact)
    )
    np.testing.assert_array_equal(volume.sample(points), same.sample(points))


def test_the_nearest_of_one_place_is_that_of_many() -> None:
    volume = placed(np.random.default_rng(6).random((4, 5, 3)), seed=7)
    halves = np.stack(np.meshgrid(*3 * [np.arange(-1.5, 6.0, 0.5)]), -1).reshape(-1, 3)
    places = world(volume, halves + 1e-4)
    many = volume.nearest(places, -9.0)
    one = [volume.at_nearest(place.tolist(), -9.0) for place in places]
    np.testing.assert_array_equal(one, many)
    assert np.any(many == -9.0)
    assert np.any(many != -9.0)
    for odd in (np.nan, np.inf, -np.inf, 1e300):
        assert volume.at_nearest((odd, 0.0, 0.0), -9.0) == -9.0


def test_values_are_read_only_shared_and_the_callers_array_stays_free() -> None:
    values = np.zeros((2, 3, 4), dtype=np.uint8)
    volume = Volume(values, np.ones(3), np.zeros(3))
    assert np.shares_memory(volume.values, values)
    assert not volume.values.flags.writeable
    values[0, 0, 0] = 7
    with pytest.raises(ValueError, match="read-only"):
        volume.values[0, 0, 0] = 1
    assert volume.shape == (2, 3, 4)


def test_fortran_order_is_made_x_fastest() -> None:
    values = np.asfortranarray(np.arange(24.0).reshape(2, 3, 4))
    volume = Volume(values, np.ones(3), np.zeros(3))
    assert volume.values.flags.c_contiguous
    assert np.array_equal(volume.values, values)


def test_with_values_keeps_the_grid_only() -> None:
    volume = placed(np.zeros((3, 4, 5)), seed=2)
    other = volume.with_values(np.ones((3, 4, 5), np.uint8), background=0)
    assert np.array_equal(other.world_from_voxel, volume.world_from_voxel)
    assert other.values.dtype == np.uint8
    assert other.background == 0
    with pytest.raises(ValueError, match="do not fit"):
        volume.with_values(np.ones((3, 4, 4)), background=0)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"values": np.zeros((3, 3))}, "three axes"),
        ({"values": np.zeros((3, 3, 1))}, "at least 2"),
        ({"values": np.zeros((0, 4, 4))}, "at least 2"),
        ({"values": np.zeros((1, 1, 1))}, "at least 2"),
        ({"values": np.zeros((2, 2, 2), complex)}, "real numbers"),
        ({"values": np.zeros((2, 2, 2), bool)}, "real numbers"),
        ({"spacing_mm": np.array([1, 0, 1])}, "spacing"),
        ({"spacing_mm": np.array([1, -1.0, 1])}, "spacing"),
        ({"spacing_mm": np.array([1, np.nan, 1])}, "spacing"),
        ({"spacing_mm": np.array([1, np.inf, 1])}, "spacing"),
        ({"spacing_mm": np.ones(2)}, "spacing"),
        ({"origin_mm": np.array([0, np.inf, 0])}, "origin"),
        ({"direction": np.ones((3, 3))}, "orthonormal"),
        ({"direction": np.zeros((3, 3))}, "orthonormal"),
        ({"direction": np.eye(3) + 1e-5}, "orthonormal"),
        ({"direction": 2 * np.eye(3)}, "orthonormal"),
        ({"direction": np.full((3, 3), np.nan)}, "orthonormal"),
    ],
)
def test_bad_grids_are_refused(change: dict[str, Any], message: str) -> None:
    good = {
        "values": np.zeros((2, 2, 2)),
        "spacing_mm": np.ones(3),
        "origin_mm": np.zeros(3),
    }
    with pytest.raises(ValueError, match=message):
        Volume(**(good | change))


@given(seed=SEEDS, at=st.tuples(*[st.floats(-1.5, 5.5)] * 3))
def test_one_place_in_voxels_is_what_sampling_it_gives(
    seed: int, at: tuple[float, float, float]
) -> None:
    values = np.random.default_rng(seed).normal(0, 100, (4, 5, 6)).astype(np.float32)
    volume = placed(values, seed, background=-7.25)
    voxel = np.array(at)
    nearest = np.abs(voxel - np.clip(voxel, 0, np.array([5, 4, 3]))).max()
    # the edge of the box itself is a matter of rounding on the way through the world
    if nearest < 1e-9:
        voxel = np.clip(voxel, 1e-9, np.array([5, 4, 3]) - 1e-9)
    expected = float(volume.sample(world(volume, voxel)))
    assert volume.at_voxel(voxel) == pytest.approx(expected, rel=1e-6, abs=1e-4)
    corner = np.array([5.0, 4.0, 3.0])
    assert volume.at_voxel(corner) == values[3, 4, 5]
    assert volume.at_voxel(np.zeros(3)) == values[0, 0, 0]


@pytest.mark.parametrize("kind", [np.uint8, np.int16, np.float32])
def test_the_nearest_voxel_is_told_to_the_bit_and_outside_as_asked(
    kind: type[np.generic],
) -> None:
    rng = np.random.default_rng(4)
    values = rng.integers(0, 100, (3, 4, 5)).astype(kind)
    volume = placed(values, seed=6, background=9.0)
    index = np.argwhere(np.ones(values.shape))[:, ::-1]
    near = world(volume, index + rng.uniform(-0.49, 0.49, index.shape))
    np.testing.assert_array_equal(volume.nearest(near), values.reshape(-1))
    away = near[:1] + 1e3
    # -1 is no number of uint8's: it must come back as it is, under any numpy
    assert volume.nearest(away, -1).tolist() == [-1]
    assert volume.nearest(away).tolist() == [9.0]
