"""Compiled maps are the plain ones, and their gradients those of what they bend."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from renderers.scene import Volume
from renderers.scene.deflection import (
    Cut,
    Deflection,
    Deflector,
    Rotation,
    Scaling,
    Translation,
    maps_of,
)
from renderers.scene.kernels.deflect import (
    TOLD_BY_MM,
    away,
    bend,
    bend_gradient,
    clear_way,
    entry,
    find_bent,
    slope_of_opening,
)

CENTER = np.array([1.0, -2.0, 0.5])
NORMAL = np.array([0.2, 1.0, 0.4])
KINDS: dict[str, tuple[Deflector, ...]] = {
    "pulled": (Translation(CENTER, 5.0, np.array([1.0, 2.0, -1.2])),),
    "turned": (Rotation(CENTER, 5.0, np.array([1.0, 0.3, 2.0]), 1.3),),
    "swollen": (Scaling(CENTER, 5.0, 2.2),),
    "shrunk": (Scaling(CENTER, 5.0, 0.6),),
    "cut": (Cut(CENTER, 5.0, NORMAL, 1.5),),
}
KINDS["chain"] = (
    *KINDS["turned"],
    Scaling(CENTER + 2, 4.0, 1.5),
    *KINDS["pulled"],
    Cut(CENTER - 1, 3.0, np.array([1.0, 0, 0]), 0.8),
)


def turned_volume(mirrored: bool) -> Volume:
    rng = np.random.default_rng(4)
    direction = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    if (np.linalg.det(direction) < 0) != mirrored:
        direction[:, 0] *= -1
    values = np.zeros((5, 6, 7), np.float32)
    return Volume(values, np.array([0.5, 0.7, 0.9]), np.array([3.0, 1, 2]), direction)


def bent(
    maps: NDArray[np.float64], points: NDArray[Any]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    trail = np.empty((len(maps), 3))
    moved = points.copy()
    openings = np.array([bend(maps, point, trail) for point in moved])
    return moved, openings


@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("name", list(KINDS))
def test_they_are_the_plain_maps_in_any_frame(name: str, mirrored: bool) -> None:
    volume, deflection = turned_volume(mirrored), Deflection(KINDS[name])
    maps = maps_of(deflection, volume)
    x = CENTER + np.random.default_rng(1).uniform(-6, 6, (400, 3))
    local = (x - volume.origin_mm) @ volume.direction
    moved, openings = bent(maps, local)
    world = moved @ volume.direction.T + volume.origin_mm
    np.testing.assert_allclose(world, deflection.pull_back(x), atol=1e-12)
    np.testing.assert_allclose(openings, deflection.opening(x), atol=1e-12)
    # gradients: those of a linear field of the tissue
    slope = np.array([0.3, -1.0, 0.7])
    wanted = np.einsum("nji,j->ni", deflection.jacobian(x), slope)
    found = np.tile(volume.direction.T @ slope, (len(x), 1))
    trail = np.empty((len(maps), 3))
    for gradient, point in zip(found, local, strict=True):
        bend(maps, point.copy(), trail)
        bend_gradient(maps, trail, gradient)
    np.testing.assert_allclose(found @ volume.direction.T, wanted, atol=1e-12)


@given(
    st.tuples(*[st.floats(-20, 20)] * 3),
    st.tuples(*[st.floats(-1, 1)] * 3),
    st.integers(1, 400),
)
def test_rays_that_are_not_marked_meet_no_ball(
    origin: tuple[float, float, float], step: tuple[float, float, float], count: int
) -> None:
    if math.hypot(*step) < 1e-3:
        return
    volume = turned_volume(False)
    maps = maps_of(Deflection(KINDS["chain"]), volume)
    geometry = np.zeros((2, 8), np.float32)
    geometry[0, :3], geometry[0, 3:6] = origin, step
    marked = np.zeros(1, np.bool_)
    counts = np.array([count], np.int32)
    find_bent(maps, geometry, counts, volume.spacing_mm, 0.01, marked)
    at = np.linspace(0, count - 1, 4 * count)
    points = geometry[0, :3] + at[:, None] * geometry[0, 3:6]
    near = np.array([away(maps, p * volume.spacing_mm) for p in points.astype(float)])
    if not marked[0]:
        assert (near > 0).all()
    elif near.min() > 0:
        # the closest point may lie between those looked at
        assert near.min() < 0.02 + np.linalg.norm(geometry[0, 3:6])


@given(
    st.tuples(*[st.floats(-9, 9)] * 3),
    st.tuples(*[st.floats(-1, 1)] * 3),
    st.sampled_from(sorted(KINDS)),
)
def test_a_ray_enters_the_first_ball_where_it_is_told(
    eye: tuple[float, float, float], way: tuple[float, float, float], name: str
) -> None:
    if math.hypot(*way) < 1e-3:
        return
    maps = maps_of(Deflection(KINDS[name]), turned_volume(False))
    maps[:, 1:4] -= maps[0, 1:4]
    unit = np.array(way) / math.hypot(*way)
    first = entry(maps, np.array(eye), unit)
    before = np.linspace(0, min(first, 60.0), 300, endpoint=False)
    for at in before:
        assert away(maps, np.array(eye) + at * unit) > 0 or at == 0 == first
    if first < np.inf:
        assert away(maps, np.array(eye) + (first + 1e-6) * unit) < 1e-5


def test_a_face_slopes_as_its_openings_do() -> None:
    deflection, volume = Deflection(KINDS["cut"]), turned_volume(True)
    maps = maps_of(deflection, volume)
    x = CENTER + np.random.default_rng(6).uniform(-2, 2, (100, 3))
    beside, trail, slope = np.empty(3), np.empty((1, 3)), np.empty(3)
    step = 1e-5
    for world in x:
        if abs((world - CENTER) @ NORMAL) < 1e-3:
            continue
        at = (world - volume.origin_mm) @ volume.direction
        slope_of_opening(maps, at, beside, trail, slope)
        sides = world + step * np.vstack([np.eye(3), -np.eye(3)])
        opened = deflection.opening(sides)
        wanted = (opened[:3] - opened[3:]) / (2 * step)
        found = volume.direction @ slope / (2 * TOLD_BY_MM)
        np.testing.assert_allclose(found, wanted, atol=1e-5)


@given(st.integers(0, 2**31), st.floats(0.02, 0.55), st.booleans())
def test_no_tissue_is_missed_on_a_clear_way(
    seed: int, share: float, twice: bool
) -> None:
    """Round a ball of tissue, cut anywhere: a distance that is one everywhere."""
    rng = np.random.default_rng(seed)
    cuts = [
        Cut(rng.uniform(-1, 1, 3), 4.0, rng.normal(size=3), share * 4.0)
        for _ in range(1 + twice)
    ]
    deflection = Deflection(tuple(cuts))
    x = rng.uniform(-4, 4, (60, 3))
    inside, opening = 2.0 - norms(deflection.pull_back(x)), deflection.opening(x)
    in_air = np.minimum(inside, opening) < 0
    for place, deep, gap in zip(
        x[in_air], inside[in_air], opening[in_air], strict=True
    ):
        way = clear_way(deep, gap, deflection.stretch)
        assert way > 0
        around = rng.normal(size=(40, 3))
        around *= (way * rng.uniform(0, 1, 40) ** 0.2 / norms(around))[:, None]
        there = place + around
        met = np.minimum(
            2.0 - norms(deflection.pull_back(there)), deflection.opening(there)
        )
        assert (met < 0).all()


def norms(x: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(np.linalg.norm(x, axis=-1))
