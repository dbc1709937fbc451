import numpy as np
from numpy.testing import assert_array_equal
from numpy.typing import NDArray

from renderers.fsr.surfels import SurfelRasterizer
from renderers.scene import Camera, GBuffer, Volume
from renderers.scene.thread_pool import ThreadPool


def walked(volume: Volume, camera: Camera) -> NDArray[np.float64]:
    """Walk all rays in steps of .02 mm to the first tissue."""
    origin, ray = camera.rays()
    depth = np.full(ray.shape[:2], np.inf)
    for t in np.arange(0.0, 16.0, 0.02):
        met = (volume.sample(origin + t * ray) > 0) & ~np.isfinite(depth)
        depth[met] = t - 0.01
    depth[~np.any(camera.lens_table() != 0, axis=-1)] = np.inf
    return depth


def wrong(buffer: GBuffer, truth: NDArray[np.float64]) -> int:
    both = np.isfinite(truth) & (buffer.coverage > 0)
    off = np.abs(np.where(both, buffer.depth_mm, 0) - np.where(both, truth, 0))
    return int(np.count_nonzero(off > 0.5))


def test_discs_no_longer_stand_over_free_edges(
    bars: Volume, camera: Camera, pool: ThreadPool
) -> None:
    truth = walked(bars, camera)
    ragged = SurfelRasterizer(bars, sharp=False).draw(camera, pool)
    rasterizer = SurfelRasterizer(bars)
    sharp = rasterizer.draw(camera, pool)
    assert wrong(ragged, truth) > 100
    assert wrong(sharp, truth) < wrong(ragged, truth) / 3
    moved = sharp.depth_mm != ragged.depth_mm
    assert moved.sum() == rasterizer.counters["rim pixels moved"]
    assert rasterizer.counters["rim rays traced"] < 0.2 * moved.size
    # a disc that stands over an edge hides what is farther
    assert np.all(sharp.depth_mm[moved] > ragged.depth_mm[moved])
    assert_array_equal(sharp.coverage, ragged.coverage)
    length = np.linalg.norm(sharp.normal[moved], axis=-1)
    np.testing.assert_allclose(length, 1, atol=1e-5)
    # each is where its own ray meets the wall, whose normal it has there
    origin, ray = camera.rays()
    along = sharp.depth_mm[moved].astype(np.float64)[:, None] * ray[moved]
    place = np.broadcast_to(origin, ray.shape)[moved] + along
    apart_mm = np.abs(bars.sample(place))
    assert apart_mm.max() < 0.01
    assert np.percentile(apart_mm, 90) < 1e-4
    away = 0.15 * np.eye(3)
    slope = [bars.sample(place + a) - bars.sample(place - a) for a in away]
    rise = np.stack(slope, axis=-1)
    rise /= np.linalg.norm(rise, axis=-1, keepdims=True)
    towards_air = -(rise * sharp.normal[moved]).sum(axis=-1)
    assert towards_air.min() > 0.99


def test_a_round_room_without_edges_is_left_alone(
    hollow: Volume, pool: ThreadPool
) -> None:
    camera = Camera.looking_at([0.2, 0.1, 0], [0.3, 5, 0], size=(96, 96))
    sharp = SurfelRasterizer(hollow).draw(camera, pool)
    ragged = SurfelRasterizer(hollow, sharp=False).draw(camera, pool)
    assert_array_equal(sharp.depth_mm, ragged.depth_mm)
    assert_array_equal(sharp.normal, ragged.normal)
