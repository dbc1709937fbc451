import numpy as np
import pytest

from anatomy.kernels.tables import Grids
from anatomy.phantom.air import (
    distance_at_points,
    evaluate_lattice,
    remove_slivers,
    seal_cavities,
)
from anatomy.phantom.lattice import Lattice
from anatomy.phantom.model import BAND_MM, Model, build_model
from anatomy.phantom.parameters import PhantomParameters

BOX = ((-24.0, 6.0), (-18.0, 30.0), (-6.0, 44.0))


@pytest.fixture(scope="module")
def model() -> Model:
    return build_model(PhantomParameters(septal_deviation_mm=3.0))


@pytest.fixture(scope="module")
def lattice() -> Lattice:
    return Lattice.covering(0.7, BOX)


@pytest.fixture(scope="module")
def plain(model: Model, lattice: Lattice) -> Grids:
    return evaluate_lattice(model, lattice, skipping=False)[0]


def same(a: Grids, b: Grids) -> bool:
    return all(np.array_equal(getattr(a, n), getattr(b, n)) for n in Grids._fields)


def test_skipping_loses_nothing_and_skips(
    model: Model, lattice: Lattice, plain: Grids
) -> None:
    grids, effort = evaluate_lattice(model, lattice)
    assert same(grids, plain)
    assert effort.part_evaluations < 0.4 * effort.parts_seen
    assert effort.bricks_in_reach <= effort.bricks


@pytest.mark.parametrize(("edge", "threads"), [(3, 1), (8, 3), (13, 2)])
def test_brick_size_and_threads_change_no_bit(
    model: Model, lattice: Lattice, plain: Grids, edge: int, threads: int
) -> None:
    grids, _ = evaluate_lattice(model, lattice, threads, edge)
    assert same(grids, plain)


def test_another_field_of_view_gives_the_same_voxels(
    model: Model, lattice: Lattice, plain: Grids
) -> None:
    other = Lattice.covering(0.7, ((-20.0, 1.0), (-14.0, 26.0), (3.0, 33.0)))
    grids, _ = evaluate_lattice(model, other)
    x, y, z = (b - a for a, b in zip(lattice.first, other.first, strict=True))
    nz, ny, nx = other.shape
    for name in Grids._fields:
        large = getattr(plain, name)[z : z + nz, y : y + ny, x : x + nx]
        assert np.array_equal(getattr(grids, name), large)


def test_the_continuous_query_is_the_sampled_field(
    model: Model, lattice: Lattice, plain: Grids
) -> None:
    index = np.random.default_rng(0).integers(0, lattice.shape, (3000, 3))
    points = lattice.origin_mm + lattice.spacing_mm * index[:, ::-1]
    sampled = plain.air[tuple(index.T)]
    continuous = np.minimum(distance_at_points(model, points), BAND_MM)
    assert np.abs(sampled - continuous).max() < 1e-4


def test_nothing_is_nan_far_outside(model: Model) -> None:
    points = np.random.default_rng(0).uniform(-500, 500, (500, 3))
    assert np.all(np.isfinite(distance_at_points(model, points)))


def test_points_of_the_wrong_shape_are_refused(model: Model) -> None:
    with pytest.raises(ValueError, match=r"shape \(\.\.\., 3\)"):
        distance_at_points(model, np.zeros((3, 2)))


def test_specks_go_and_large_pieces_stay() -> None:
    air = np.full((20, 20, 20), 1.0, dtype=np.float32)
    air[1:12, 1:12, 1:12] = -1.0
    air[14:19, 14:19, 14:19] = -0.5
    air[15, 2, 2] = -0.25
    part = np.zeros(air.shape, dtype=np.uint8)
    assert remove_slivers(air, part, 1.0) == 1
    assert air[15, 2, 2] == 0.25
    assert air[16, 16, 16] == -0.5
    assert np.all(air[1:12, 1:12, 1:12] == -1.0)


def test_one_airway_has_nothing_to_remove() -> None:
    air = np.full((5, 5, 5), -1.0, dtype=np.float32)
    assert remove_slivers(air, np.zeros(air.shape, dtype=np.uint8), 0.5) == 0


def test_a_piece_that_the_field_of_view_cuts_stays() -> None:
    air = np.full((20, 20, 20), 1.0, dtype=np.float32)
    air[1:12, 1:12, 1:12] = -1.0
    air[15, 15, 17:] = -0.25
    air[15, 2, 2] = -0.25
    assert remove_slivers(air, np.zeros(air.shape, dtype=np.uint8), 1.0) == 1
    assert air[15, 15, 19] == -0.25
    assert air[15, 2, 2] == 0.25


def test_cavities_that_touch_are_parted_where_they_are_shallow() -> None:
    """By one voxel; ducts, the two noses, and what touches nothing stay as they are."""
    air = np.full((3, 3, 8), 1.0, np.float32)
    air[1, 1, :] = [-1, -0.4, -0.9, -1, -1, -1, -1, -1]
    part = np.zeros(air.shape, np.uint8)
    part[1, 1, :] = [0, 0, 1, 1, 2, 3, 3, 4]
    after = air.copy()
    # a sinus, a cell of the same side, a duct, and the noses of both sides
    seal_cavities(after, part, [23, 25, 0, 21, 11])
    changed = np.argwhere(after != air)
    assert changed.tolist() == [[1, 1, 1]]
    assert after[1, 1, 1] > 0
