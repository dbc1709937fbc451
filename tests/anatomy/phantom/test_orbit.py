import msgspec
import numpy as np
import pytest

from anatomy.frame import lps_from_ras
from anatomy.phantom.fixed_shapes import SHAPES
from anatomy.phantom.orbit import (
    FLOOR_BONE_MM,
    lateral_wall,
    orbit_walls,
)
from anatomy.phantom.parameters import PhantomParameters
from anatomy.phantom.phantom import build_phantom, distance_at
from anatomy.phantom.variants import with_variants
from anatomy.queries.landmarks import landmarks

STRAIGHT = PhantomParameters(septal_deviation_mm=0.0)


@pytest.mark.parametrize("scale", [0.8, 1.0, 1.1])
def test_no_maxillary_air_reaches_into_the_orbits_floor(scale: float) -> None:
    head = msgspec.structs.replace(STRAIGHT, maxillary_scale=scale, unevenness=1.5)
    rng = np.random.default_rng(0)
    points = rng.uniform([18, -44, 10], [36, -20, 30], (40_000, 3))
    inside = distance_at(head, lps_from_ras(points)) < 0
    assert np.count_nonzero(inside) > 2000
    room = orbit_walls().evaluate(points[inside].T)
    assert room.min() >= head.mucosa_mm + FLOOR_BONE_MM - 1e-3


def test_the_orbit_narrows_to_its_apex_and_its_floor_climbs() -> None:
    u, z = np.linspace(14, 55, 206), np.linspace(15, 62, 236)
    grid = np.stack(np.meshgrid(u, z, indexing="ij")).reshape(2, -1)
    areas, floors = [], []
    for depth in (14.0, 24.0, 34.0, 42.0, 48.0):
        at = np.stack([grid[0], np.full(grid.shape[1], -depth), grid[1]])
        inside = orbit_walls().evaluate(at) < 0
        areas.append(np.count_nonzero(inside) * 0.04)
        floors.append(grid[1][inside].min())
    assert np.all(np.diff(areas) < 0)
    assert areas[-1] < 0.15 * areas[0]
    assert np.all(np.diff(floors[1:]) > 1.0)
    # 35.9 mm high on 200 orbits (PMC9443057)
    front = orbit_walls().evaluate(np.array([[30.0] * 236, [-14.0] * 236, list(z)]))
    assert np.count_nonzero(front < 0) * 0.2 == pytest.approx(35.9, abs=4.0)


@pytest.mark.parametrize("depth", [16.0, 24.0, 32.0])
def test_the_orbit_has_no_corners(depth: float) -> None:
    """Its outer half fills its box little more than an ellipse would."""
    u, z = np.linspace(14, 55, 206), np.linspace(15, 62, 236)
    grid = np.stack(np.meshgrid(u, z, indexing="ij")).reshape(2, -1)
    at = np.stack([grid[0], np.full(grid.shape[1], -depth), grid[1]])
    inside = (orbit_walls().evaluate(at) < 0).reshape(206, 236)
    across = np.flatnonzero(inside.any(1))
    outer = inside[across[len(across) // 2] : across[-1] + 1]
    up = np.flatnonzero(outer.any(0))
    share = outer[:, up[0] : up[-1] + 1].mean()
    # An ellipse fills pi / 4.
    assert 0.72 < share < 0.88


def test_globe_and_muscles_lie_in_the_orbit_and_the_lateral_wall_outside() -> None:
    rng = np.random.default_rng(0)
    points = rng.uniform([14, -48, 20], [52, 2, 58], (60_000, 3)).T
    walls = orbit_walls().evaluate(points)
    globe = SHAPES["globe"].evaluate(points) < 0
    # before the tendons at the apex
    deep = (points[1] < -12.0) & (points[1] > -42.0)
    assert walls[globe].max() < 0
    assert (
        np.mean(walls[(SHAPES["eye muscles"].evaluate(points) < 0) & deep] < 0) > 0.97
    )
    bone = lateral_wall().evaluate(points) < 0
    assert np.count_nonzero(bone & (walls > 0.2)) > 500


def test_a_dehiscent_lamina_is_bare_on_its_side_alone() -> None:
    head = with_variants(STRAIGHT, ["dehiscent-lamina:left"])
    center = landmarks(head)["lamina dehiscence, left"].position_mm
    most = {}
    for side, sign in (("left", 1.0), ("right", -1.0)):
        x = sorted(sign * (center[0] + d) for d in (-1.0, 1.0))
        box = ((x[0], x[1]), (center[1] - 1.5, center[1] + 1.5), (37.0, 40.0))
        made = build_phantom(head, 0.25, field_mm=box)
        most[side] = float(np.median(made.ct.values.max(axis=2)))
    assert most["left"] < 60.0
    assert most["right"] > 250.0
