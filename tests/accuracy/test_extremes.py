"""Heads and voxels at the ends of their ranges."""

import numpy as np
import pytest

from anatomy.phantom.air import distance_at_points, evaluate_lattice
from anatomy.phantom.lattice import Box, Lattice
from anatomy.phantom.model import build_model
from anatomy.phantom.parameters import PhantomParameters
from anatomy.phantom.phantom import Phantom, build_phantom
from anatomy.tissue import AIR_LABELS, Label
from benchmarks.phantom_figures.sinus_volumes import leaks
from tests.slow_cases import slow

HEADS = (
    PhantomParameters(),
    PhantomParameters(keros_mm=1.0, septal_deviation_mm=-6.0, head_scale=0.9),
    PhantomParameters(keros_mm=12.0, septal_deviation_mm=6.0, head_scale=1.08),
    PhantomParameters(frontal_scale=0.0, unevenness=1.5, mucosa_mm=0.2),
)
ANY_HEAD = pytest.mark.parametrize(
    "parameters", [HEADS[2], *slow(*HEADS[:2], HEADS[3])]
)
OSTIOMEATAL: Box = ((-18.0, -3.0), (17.0, 33.0), (19.0, 33.0))
"""Walls, a turbinate and the maxillary ostium: 0.4 million voxels of 0.2 mm."""

FINEST_MM, COARSEST_MM = 0.2, 3.0


def check(phantom: Phantom) -> None:
    """Check what holds for any voxel: numbers, signs, and a distance that is one."""
    d, h = phantom.distance.values, phantom.spacing_mm
    assert np.all(np.isfinite(d))
    assert phantom.ct.values.min() >= -1000
    assert phantom.ct.values.max() < 2500
    labels = phantom.labels.values
    assert set(np.unique(labels)) <= set(Label)
    assert np.array_equal(np.isin(labels, list(AIR_LABELS)), d < 0)
    for axis in range(3):
        # Neighbours differ by less than a voxel, apart from the first order's error.
        assert np.abs(np.diff(d, axis=axis)).max() < 1.1 * h


@ANY_HEAD
def test_the_finest_voxels_make_sense(parameters: PhantomParameters) -> None:
    phantom = build_phantom(parameters, FINEST_MM, field_mm=OSTIOMEATAL)
    check(phantom)
    index = np.random.default_rng(0).integers(0, phantom.ct.shape, (4000, 3))
    points = phantom.ct.origin_mm + phantom.spacing_mm * index[:, ::-1]
    model = distance_at_points(build_model(parameters), points)
    stored = phantom.distance.values[tuple(index.T)]
    clear = np.abs(model) > 0.1
    # Slivers of air that were removed are the difference.
    assert np.mean((model < 0)[clear] == (stored < 0)[clear]) > 0.999


@ANY_HEAD
def test_the_coarsest_voxels_make_sense(parameters: PhantomParameters) -> None:
    # No ostium is as wide as a voxel, so drainage has no meaning here.
    check(build_phantom(parameters, COARSEST_MM))


@ANY_HEAD
def test_heads_at_the_ends_of_their_ranges_do_not_leak(
    parameters: PhantomParameters,
) -> None:
    assert leaks(build_phantom(parameters, 0.7)) == []


def test_finest_and_coarsest_voxels_are_points_of_one_head() -> None:
    model = build_model(PhantomParameters())
    coarse, fine = (
        evaluate_lattice(model, Lattice.covering(h, OSTIOMEATAL))[0]
        for h in (COARSEST_MM, FINEST_MM)
    )
    # 0.2 mm has no exact binary fraction: places differ by a rounding.
    starts = [
        Lattice.covering(h, OSTIOMEATAL).origin_mm for h in (COARSEST_MM, FINEST_MM)
    ]
    offset = np.round((starts[0] - starts[1]) / FINEST_MM).astype(int)[::-1]
    shared = fine.air[offset[0] :: 15, offset[1] :: 15, offset[2] :: 15]
    z, y, x = coarse.air.shape
    assert np.abs(shared[:z, :y, :x] - coarse.air).max() < 1e-4


def test_finer_voxels_skip_more() -> None:
    # What is evaluated follows the surfaces: halving the voxel makes eight times the
    # voxels, and less than six times the work.
    work = []
    for spacing in (1.0, 0.5, 0.25):
        lattice = Lattice.covering(spacing, OSTIOMEATAL)
        effort = evaluate_lattice(build_model(PhantomParameters()), lattice)[1]
        work.append(effort.part_evaluations / effort.parts_seen)
    assert work[0] > 1.2 * work[1] > 1.2**2 * work[2]
