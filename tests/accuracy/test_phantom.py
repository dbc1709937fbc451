"""The phantom beside the literature: what makes it a head and not a maze."""

import itertools
from collections.abc import Iterator

import numpy as np
import pytest
from scipy import ndimage

from anatomy.phantom.air import distance_at_points, evaluate_lattice
from anatomy.phantom.lattice import Lattice
from anatomy.phantom.model import build_model
from anatomy.phantom.parameters import SIDED_VARIANTS, LeftRatios, PhantomParameters
from anatomy.phantom.phantom import Phantom, build_phantom
from anatomy.phantom.population import draw_parameters
from anatomy.phantom.variants import with_variants
from anatomy.tissue import AIR_LABELS
from benchmarks.phantom_figures.sinus_volumes import (
    SIDES,
    SINUSES,
    anterior_share,
    leaks,
    sinus_volumes_ml,
    spine_distances_mm,
    volume_ml,
)
from tests.slow_cases import slow


@pytest.fixture(scope="module")
def head() -> Phantom:
    return build_phantom(PhantomParameters(), 0.6)


def test_the_default_head_has_average_sinuses(head: Phantom) -> None:
    for side in SIDES:
        ml = sinus_volumes_ml(head, side)
        assert ml["maxillary"] == pytest.approx(14.0, abs=1.5)
        assert ml["frontal"] == pytest.approx(3.0, abs=0.6)
        assert ml["sphenoid"] == pytest.approx(4.4, abs=0.7)
        assert ml["ethmoid"] == pytest.approx(6.0, abs=1.0)
        assert 0.56 < anterior_share(head, side) < 0.60


# mean, standard deviation and range of 140 CTs, mm
PUBLISHED = {
    "basal lamella": (48.4, 4.4, 38.6, 59.8),
    "skull base behind it": (62.3, 5.0, 51.3, 73.5),
    "skull base at the recess": (57.0, 4.8, 43.1, 70.3),
    "sphenoid face": (61.4, 4.6, 50.4, 73.6),
    "nasofrontal beak": (51.4, 4.6, 41.5, 63.8),
}


def test_distances_from_the_spine_are_those_published() -> None:
    for name, value in spine_distances_mm(PhantomParameters()).items():
        mean, spread, _, _ = PUBLISHED[name]
        assert value == pytest.approx(mean, abs=spread), name
    for seed in range(200):
        for name, value in spine_distances_mm(draw_parameters(seed)).items():
            _, _, low, high = PUBLISHED[name]
            assert low < value < high, (seed, name)


def test_the_airway_is_one_piece_that_drains_through_its_ostia(head: Phantom) -> None:
    assert ndimage.label(head.distance.values < 0)[1] == 1
    assert leaks(head) == []


def test_labels_and_distance_agree_with_the_model(head: Phantom) -> None:
    rng = np.random.default_rng(0)
    index = rng.integers(2, np.array(head.ct.shape) - 2, (60_000, 3))
    d = head.distance.values[tuple(index.T)]
    near = np.abs(d) < 1.0
    index, d = index[near], d[near]
    points = head.ct.origin_mm + head.spacing_mm * index[:, ::-1]
    model = build_model(head.parameters)
    steps = 0.02 * np.concatenate([np.zeros((1, 3)), np.eye(3), -np.eye(3)])
    values = distance_at_points(model, points[:, None] + steps)
    slope = np.linalg.norm(values[:, 1:4] - values[:, 4:7], axis=1) / 0.04
    air = np.isin(head.labels.values[tuple(index.T)], list(AIR_LABELS))
    clear = np.abs(values[:, 0]) > 0.1
    assert np.mean((values[:, 0] < 0)[clear] == air[clear]) > 0.9995
    # Where both are near the surface and the model is smooth they are one distance.
    close = (np.abs(d) < 0.4) & (slope > 0.5)
    error = np.abs(values[close, 0] / slope[close] - d[close])
    assert np.median(error) < 0.02
    assert np.percentile(error, 90) < 0.05


def variants_alone() -> Iterator[PhantomParameters]:
    """List heads with every variant alone."""
    plain = PhantomParameters()
    for name in SIDED_VARIANTS:
        yield with_variants(plain, [name])


def stressed() -> Iterator[PhantomParameters]:
    """List extreme heads: all variants together, and extreme sizes."""
    plain = PhantomParameters()
    yield with_variants(plain, SIDED_VARIANTS)
    yield PhantomParameters(keros_mm=1.0, septal_deviation_mm=-6.0, head_scale=0.9)
    yield PhantomParameters(keros_mm=12.0, septal_deviation_mm=6.0, head_scale=1.08)
    yield PhantomParameters(frontal_scale=0.0, roof_mm=-3.5, ethmoid_scale=0.7)
    yield PhantomParameters(
        frontal_scale=1.35,
        roof_mm=3.5,
        ethmoid_scale=1.3,
        maxillary_scale=1.1,
        sphenoid_scale=1.1,
        left=LeftRatios(maxillary=0.5, frontal=0.4, sphenoid=0.6, ethmoid=0.6),
    )


@pytest.mark.parametrize(
    "parameters", [next(stressed()), *slow(*list(stressed())[1:], *variants_alone())]
)
def test_extreme_heads_are_whole(parameters: PhantomParameters) -> None:
    phantom = build_phantom(parameters, 1.2)
    for values in (phantom.distance.values, phantom.ct.values):
        assert np.all(np.isfinite(values))
    assert phantom.ct.values.min() >= -1000
    for side in SIDES:
        assert 2.0 < volume_ml(phantom, SINUSES["maxillary"], side) < 30.0


@pytest.mark.slow
@pytest.mark.parametrize("pair", [*itertools.combinations(SIDED_VARIANTS, 2)])
def test_variants_in_pairs_do_not_leak(pair: tuple[str, str]) -> None:
    phantom = build_phantom(with_variants(PhantomParameters(), pair), 0.7)
    assert leaks(phantom) == []


@pytest.mark.slow
@pytest.mark.parametrize("first", range(0, 200, 20))
def test_drawn_heads_do_not_leak(first: int) -> None:
    for seed in range(first, first + 20):
        phantom = build_phantom(draw_parameters(seed), 0.6)
        assert leaks(phantom) == [], seed
        assert ndimage.label(phantom.distance.values < 0)[1] == 1, seed


@pytest.mark.slow
@pytest.mark.timeout(1200)
def test_sinus_volumes_of_200_heads_are_those_published() -> None:
    drawn = []
    for seed in range(200):
        phantom = build_phantom(draw_parameters(seed), 1.2)
        drawn += [[*sinus_volumes_ml(phantom, side).values()] for side in SIDES]
    mean, spread = np.mean(drawn, axis=0), np.std(drawn, axis=0)
    assert mean == pytest.approx([12.9, 2.92, 4.0, 5.5], rel=0.10)
    published = np.array([4.4, 2.57, 1.99, 2.0])
    assert np.all(spread < 1.5 * published)
    assert np.all(spread > published / 1.6)


def test_another_voxel_gives_the_same_head_bit_for_bit() -> None:
    box = ((-30.0, -2.0), (10.0, 50.0), (20.0, 52.0))
    model = build_model(PhantomParameters())
    coarse, fine = (
        evaluate_lattice(model, Lattice.covering(h, box))[0] for h in (1.0, 0.5)
    )
    assert np.array_equal(fine.air[::2, ::2, ::2], coarse.air)
    assert np.array_equal(fine.part[::2, ::2, ::2], coarse.part)
