"""Edges of cuts in splatted pictures lie where the field's zero is."""

import math

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from numpy.typing import NDArray

from renderers.fsr.kernels.cut_rims import gradient_at
from renderers.fsr.surfels import SurfelRasterizer
from renderers.fsr.surfels.crease_tracing import CreaseTracer
from renderers.scene import AirSurface, Camera, GBuffer, Volume
from renderers.scene.thread_pool import ThreadPool
from tests.renderers.wounded_surface import WoundedSurface

Pixels = NDArray[np.float64]

PLACE = np.array([0.0, 5.7, 0.0])
BESIDE = PLACE + np.array([2.4, 0.0, 0.3])


@pytest.fixture
def patient(hollow: Volume) -> WoundedSurface:
    none = np.zeros(hollow.shape, np.uint8)
    codes = hollow.with_values(none, 0.0)
    return WoundedSurface(AirSurface(hollow, codes, codes))


def cut(patient: WoundedSurface) -> WoundedSurface:
    """Take two balls away; a sharp ridge is left between them."""
    patient.cut(PLACE, 1.5)
    patient.cut(BESIDE, 1.4)
    return patient


@pytest.fixture(scope="module")
def camera() -> Camera:
    return Camera.looking_at(
        np.array([0.4, -3.0, 0.6]), PLACE, extent=math.radians(40), size=(120, 120)
    )


def drawn(
    patient: WoundedSurface, camera: Camera, pool: ThreadPool, *, settled: bool = True
) -> GBuffer:
    creases = CreaseTracer(patient.surface) if settled else None
    rasterizer = SurfelRasterizer(patient.surface.distance, creases=creases)
    return rasterizer.draw(camera, pool)


def misses(patient: WoundedSurface, camera: Camera, buffer: GBuffer) -> Pixels:
    """Return how far pixels lie from the surface, mm; infinite where none is drawn."""
    origin, rays = camera.rays()
    seen = np.linalg.norm(rays, axis=-1) > 0.5
    depth = np.where(buffer.coverage > 0, buffer.depth_mm, 0)[..., None]
    beside = patient.surface.distance.sample((origin + depth * rays).reshape(-1, 3))
    found = np.abs(beside).reshape(buffer.size)
    away = np.where(buffer.coverage > 0, found, np.inf)
    return np.asarray(away[seen], np.float64)


def test_without_cuts_no_ray_is_traced(
    patient: WoundedSurface, camera: Camera, pool: ThreadPool
) -> None:
    buffer = drawn(patient, camera, pool, settled=False)
    assert CreaseTracer(patient.surface).trace(camera, pool, buffer) == 0
    plain = drawn(patient, camera, pool, settled=False)
    assert_array_equal(buffer.depth_mm, plain.depth_mm)
    assert_array_equal(buffer.normal, plain.normal)


def test_pixels_beside_a_cut_lie_on_the_surface(
    patient: WoundedSurface, camera: Camera, pool: ThreadPool
) -> None:
    cut(patient)
    before = misses(patient, camera, drawn(patient, camera, pool, settled=False))
    after = misses(patient, camera, drawn(patient, camera, pool))
    assert np.isfinite(after).all()
    # 20 um is what a splat may be off without being settled
    assert after.max() < 0.03 < before.max()
    assert np.count_nonzero(before > 0.02) > 50


def test_what_was_settled_has_the_normals_of_rays(
    patient: WoundedSurface, camera: Camera, pool: ThreadPool
) -> None:
    cut(patient)
    plain = drawn(patient, camera, pool, settled=False)
    buffer = drawn(patient, camera, pool)
    moved = (buffer.normal != plain.normal).any(axis=-1)
    assert np.count_nonzero(moved) > 100
    origin, rays = camera.rays()
    distance = patient.surface.distance
    for y, x in np.argwhere(moved)[::17]:
        place = origin[y, x] + buffer.depth_mm[y, x] * rays[y, x]
        gradient = np.empty(3)
        gradient_at(
            distance.values,
            1 / distance.spacing_mm,
            place - distance.origin_mm,
            gradient,
        )
        normal = -gradient / np.linalg.norm(gradient)
        assert normal @ buffer.normal[y, x] > 0.9999
        assert abs(np.linalg.norm(buffer.normal[y, x]) - 1) < 1e-5


def test_holes_beside_a_cut_are_closed(
    patient: WoundedSurface, camera: Camera, pool: ThreadPool
) -> None:
    cut(patient)
    buffer = drawn(patient, camera, pool, settled=False)
    whole = drawn(patient, camera, pool)
    for y, x in ((60, 60), (52, 61), (70, 48)):
        there = slice(y, y + 4), slice(x, x + 4)
        buffer.coverage[there], buffer.depth_mm[there] = 0, np.inf
    CreaseTracer(patient.surface).trace(camera, pool, buffer)
    assert (buffer.coverage == whole.coverage).all()
    np.testing.assert_allclose(buffer.depth_mm, whole.depth_mm, atol=0.05)


def test_an_updated_tracer_is_a_new_one(
    patient: WoundedSurface, camera: Camera, pool: ThreadPool
) -> None:
    kept = CreaseTracer(patient.surface)
    kept.update(patient.cut(PLACE, 1.5))
    kept.update(patient.cut(BESIDE, 1.4))
    a, b = (drawn(patient, camera, pool, settled=False) for _ in range(2))
    traced = kept.trace(camera, pool, a)
    assert traced == CreaseTracer(patient.surface).trace(camera, pool, b) > 0
    assert_array_equal(a.depth_mm, b.depth_mm)
    assert_array_equal(a.normal, b.normal)
    kept.update(patient.heal())
    assert kept.trace(camera, pool, a) == 0
