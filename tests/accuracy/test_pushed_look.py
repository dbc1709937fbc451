"""Tissue that is pushed keeps its look: a place shows what it shows at rest."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from numpy.typing import NDArray

from renderers.scene import AirSurface, Camera, RestOffsets, Volume
from renderers.shading import ScopeLight, ScopeShader, Tier
from renderers.shading.hairs import HairLayer, shown_at
from renderers.shading.wounds import WallBlood
from tests.renderers.shading.conftest import CENTRE_MM, make_camera, make_surface, trace
from tests.renderers.wounded_surface import WoundedSurface

LIGHT = ScopeLight()
PLACE = CENTRE_MM + np.array([-0.7, -4.0, -5.0])
STEPS = np.array([2, 3, 1])
"""Voxels (i, j, k) by which all tissue is pushed."""


@pytest.fixture(scope="module")
def surface() -> AirSurface:
    return make_surface()


@pytest.fixture(scope="module")
def camera() -> Camera:
    return make_camera()


def carried(values: NDArray[np.generic]) -> NDArray[np.generic]:
    """Carry a volume along; what comes in at its faces is that of the other side."""
    return np.roll(values, tuple(STEPS[::-1]), axis=(0, 1, 2))


def pushed(surface: AirSurface) -> tuple[AirSurface, NDArray[np.float64]]:
    """Push all tissue by whole voxels; return how it is shown, and the way in mm."""
    distance, wounds = surface.distance, surface.wounds
    way = distance.world_from_voxel[:3, :3] @ STEPS
    assert wounds is not None
    x, y, z = (
        distance.with_values(np.full(distance.shape, -part, np.float32), 0.0)
        for part in way
    )
    box = np.array([-1, -1, -1, *distance.shape[::-1]], np.float32)

    def shown(volume: Volume) -> Volume:
        return volume.with_values(carried(volume.values), volume.background)

    found = replace(
        surface,
        distance=shown(distance),
        wounds=replace(wounds, pristine=shown(wounds.pristine)),
        rest=RestOffsets(wounds.pristine, x, y, z, box),
    )
    return found, way


def moved(camera: Camera, way: NDArray[np.float64]) -> Camera:
    frame = camera.frame.copy()
    frame[0] += way
    return replace(camera, frame=frame)


@pytest.mark.parametrize("tier", [Tier.LIVE, Tier.FULL])
def test_a_place_has_the_look_that_it_has_at_rest(
    surface: AirSurface, camera: Camera, tier: Tier
) -> None:
    patient = WoundedSurface(surface)
    patient.cut(PLACE, 2.0)
    patient.wet(PLACE + np.array([1.5, 2.0, 0.0]), 3.0, 0.4)
    buffer = trace(patient.surface, camera)
    at_rest = ScopeShader(patient.surface, tier, threads=1)
    expected = at_rest.reflectance(buffer, camera, LIGHT)
    shown, way = pushed(patient.surface)
    beside = moved(camera, way)
    found = ScopeShader(shown, tier, threads=1).reflectance(buffer, beside, LIGHT)
    # positions are rounded otherwise, and noise has steep places
    assert np.abs(found - expected).max() < 2e-3
    world = replace(shown, rest=None)
    slid = ScopeShader(world, tier, threads=1).reflectance(buffer, beside, LIGHT)
    assert np.abs(slid - expected).max() > 0.05


def test_offsets_of_zero_and_none_give_the_same_bits(
    surface: AirSurface, camera: Camera
) -> None:
    patient = WoundedSurface(surface)
    patient.cut(PLACE, 2.0)
    patient.wet(PLACE, 3.0, 0.4)
    buffer = trace(patient.surface, camera)
    plain = ScopeShader(patient.surface, threads=1).shade(buffer, camera, LIGHT)
    distance = patient.surface.distance
    still = distance.with_values(np.zeros(distance.shape, np.float32), 0.0)
    for high in (0, 30):
        box = np.array([0, 0, 0, high, high, high], np.float32)
        rest = RestOffsets(distance, still, still, still, box)
        shader = ScopeShader(replace(patient.surface, rest=rest), threads=1)
        assert_array_equal(shader.shade(buffer, camera, LIGHT), plain)


def test_light_from_pushed_walls_has_the_colour_they_have_at_rest(
    surface: AirSurface,
) -> None:
    patient = WoundedSurface(surface)
    patient.cut(PLACE, 2.0)
    patient.wet(PLACE, 3.0, 0.4)
    shown, _ = pushed(patient.surface)
    codes = carried(WallBlood(patient.surface).codes)
    inner = (slice(4, -4),) * 3
    assert_array_equal(WallBlood(shown).codes[inner], codes[inner])


def test_blood_is_told_where_it_lies_and_shown_where_it_is(surface: AirSurface) -> None:
    """An update gives what a look at everything gives."""
    patient = WoundedSurface(surface)
    shown, _ = pushed(patient.surface)
    walls = WallBlood(shown)
    walls.update(patient.wet(PLACE, 2.0, 0.4))
    assert_array_equal(walls.codes, WallBlood(shown).codes)
    assert not np.array_equal(walls.codes, surface.blood.values)


def test_hairs_go_along_with_the_skin(surface: AirSurface) -> None:
    patient = WoundedSurface(surface)
    roots = HairLayer(patient.surface, 7).strands.points_mm
    shown, way = pushed(patient.surface)
    along = HairLayer(shown, 7).strands.points_mm
    voxel = surface.distance.voxel_from_world
    inner = roots[:, 0] @ voxel[:3, :3].T + voxel[:3, 3]
    top = np.array(surface.distance.shape[::-1]) - 5
    inside = np.all((inner > 1) & (inner < top), axis=1)
    assert inside.sum() > 3
    for strand in roots[inside]:
        apart = np.abs(along - (strand + way)).max(axis=(1, 2))
        assert apart.min() < 1e-4


def test_places_at_rest_are_found_where_they_are_shown(surface: AirSurface) -> None:
    """The inverse of ``p + offset(p)``, for a push as strong as there are."""
    distance = surface.distance
    k, j, i = np.indices(distance.shape)
    m = distance.world_from_voxel
    at = np.stack([i, j, k], -1) @ m[:3, :3].T + m[:3, 3]
    share = np.maximum(1 - ((at - CENTRE_MM) ** 2).sum(-1) / 36, 0) ** 2
    push = np.array([2.0, -2.0, 2.0])
    x, y, z = (
        distance.with_values((-part * share).astype(np.float32), 0.0) for part in push
    )
    box = np.array([0, 0, 0, *distance.shape[::-1]], np.float32)
    rest = RestOffsets(distance, x, y, z, box)
    rng = np.random.default_rng(2)
    places = CENTRE_MM + rng.uniform(-6, 6, (300, 3))
    found = shown_at(rest, places)
    assert_allclose(found + rest.sample(found), places, atol=0.02)
    assert np.linalg.norm(found - places, axis=1).max() > 2.0
