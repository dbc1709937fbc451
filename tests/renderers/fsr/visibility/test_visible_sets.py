import numpy as np
import pytest
from numpy.typing import NDArray

from anatomy import PhantomParameters, build_phantom
from renderers.fsr.surfels import SurfelRasterizer
from renderers.fsr.visibility import build_visible_sets
from renderers.fsr.visibility.visible_sets import EDGE, airway_boxes
from renderers.scene import Camera, GBuffer, Volume
from renderers.scene.thread_pool import ThreadPool

LEAK_MM = 0.5


def poses(volume: Volume, count: int, seed: int, size: int) -> list[Camera]:
    """Eyes in the airway, anywhere and any way."""
    rng = np.random.default_rng(seed)
    boxes = np.argwhere(
        airway_boxes(volume).reshape([-(-(n - 1) // EDGE) for n in volume.shape])
    )
    cameras: list[Camera] = []
    matrix = volume.world_from_voxel
    while len(cameras) < count:
        voxel = (boxes[rng.integers(len(boxes))] + rng.uniform(size=3))[::-1] * EDGE
        eye = matrix[:3, :3] @ voxel + matrix[:3, 3]
        if volume.sample(eye) < -0.5 * volume.spacing_mm.max():
            target = eye + rng.normal(size=3)
            cameras.append(Camera.looking_at(eye, target, size=(size, size)))
    return cameras


def tissue_before(
    volume: Volume, camera: Camera, g: GBuffer, where: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """Say how deep in tissue the rays to what a buffer shows have been by then (mm)."""
    origin, ray = camera.rays()
    t = np.linspace(0, 1, 400) * (g.depth_mm[where, None] - LEAK_MM)
    points = origin[where][:, None] + t[..., None] * ray[where][:, None]
    return np.asarray(volume.sample(points).max(axis=-1))


def compare(volume: Volume, cameras: list[Camera], pool: ThreadPool) -> tuple[int, int]:
    """Check pictures with sets against those without; give pixels that differ."""
    bare = SurfelRasterizer(volume, hide=False)
    knowing = SurfelRasterizer(volume)
    knowing.use_visible_sets(build_visible_sets(volume, knowing.bounds(), pool))
    leaks = skipped = 0
    for camera in cameras:
        a, b = bare.draw(camera, pool), knowing.draw(camera, pool)
        assert knowing.counters["looked up"] == 1
        assert knowing.counters["listed"] <= bare.counters["listed"]
        skipped += bare.counters["listed"] - knowing.counters["listed"]
        other = (a.depth_mm != b.depth_mm) | np.any(a.normal != b.normal, axis=-1)
        other |= a.coverage != b.coverage
        assert np.array_equal(a.material, b.material)
        # only where the bare picture shows through a pinhole what tissue hides
        if other.any():
            shown = other & np.isfinite(a.depth_mm)
            assert np.all(tissue_before(volume, camera, a, shown) > 0)
        leaks += int(other.sum())
    return leaks, skipped


def test_pictures_with_sets_have_the_bits_of_those_without(
    cavities: Volume, pool: ThreadPool
) -> None:
    leaks, skipped = compare(cavities, poses(cavities, 30, 1, 64), pool)
    assert leaks == 0
    assert skipped > 0


@pytest.mark.parametrize(
    ("spacing_mm", "count"), [(1.5, 12), pytest.param(0.5, 60, marks=pytest.mark.slow)]
)
def test_in_a_head_only_pinholes_differ(
    pool: ThreadPool, spacing_mm: float, count: int
) -> None:
    """Over random eyes; what differs are a few pixels between discs, see `compare`."""
    phantom = build_phantom(PhantomParameters(), spacing_mm)
    size = 96
    cameras = poses(phantom.distance, count, 2, size)
    leaks, skipped = compare(phantom.distance, cameras, pool)
    assert skipped > 0
    # measured: 1 of 921,600 at 0.5 mm, none of 368,640 at 1.0 and at 1.5 mm
    assert leaks <= 1e-5 * count * size**2


def test_sets_are_small_where_walls_hide_much(
    cavities: Volume, pool: ThreadPool
) -> None:
    sets = build_visible_sets(cavities, SurfelRasterizer(cavities).bounds(), pool)
    assert len(sets.bits) == airway_boxes(cavities).sum()
    assert 0.3 < sets.share < 0.95


def test_bits_do_not_depend_on_threads(
    cavities: Volume, pool: ThreadPool, three: ThreadPool
) -> None:
    bounds = SurfelRasterizer(cavities).bounds()
    one = build_visible_sets(cavities, bounds, pool)
    shares: list[float] = []
    other = build_visible_sets(cavities, bounds, three, shares.append)
    assert np.array_equal(one.bits, other.bits)
    assert np.array_equal(one.table, other.table)
    assert max(shares) == 1.0


def test_eyes_outside_and_in_tissue_are_not_answered(
    cavities: Volume, pool: ThreadPool
) -> None:
    renderer = SurfelRasterizer(cavities)
    renderer.use_visible_sets(build_visible_sets(cavities, renderer.bounds(), pool))
    for eye, known in (((-6.0, 0.0, 0.0), 1), ((0.0, 4.0, 0.0), 0), ((99.0, 0, 0), 0)):
        renderer.draw(Camera.looking_at(eye, (0.1, 0.2, 0.3), size=(20, 20)), pool)
        assert renderer.counters["looked up"] == known
    renderer.use_visible_sets(None)
    renderer.draw(Camera.looking_at((-6.0, 0, 0), (0, 0.1, 0), size=(20, 20)), pool)
    assert renderer.counters["looked up"] == 0


def test_sets_of_another_surface_are_refused(
    cavities: Volume, hollow: Volume, pool: ThreadPool
) -> None:
    sets = build_visible_sets(cavities, SurfelRasterizer(cavities).bounds(), pool)
    with pytest.raises(ValueError, match="other blocks"):
        SurfelRasterizer(hollow).use_visible_sets(sets)
