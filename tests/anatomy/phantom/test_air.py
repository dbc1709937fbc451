import numpy as np
import pytest

from anatomy.kernels.tables import Grids
from anatomy.phantom.air import distance_at_points, evaluate_lattice
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
