import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from renderers.fsr.surfels import SurfelRasterizer
from renderers.scene import Camera, Projection, Volume
from renderers.scene.deflection import Cut, Deflection
from renderers.scene.thread_pool import ThreadPool
from tests.renderers.fsr.same_buffers import same

EYES = st.tuples(*[st.floats(-2.5, 2.5) for _ in range(3)])


def view(
    eye: tuple[float, float, float],
    target: tuple[float, float, float],
    size: tuple[int, int] = (96, 96),
    projection: Projection = Projection.EQUIDISTANT,
) -> Camera:
    return Camera.looking_at(eye, target, size=size, projection=projection)


def sphere_depth(camera: Camera, radius: float) -> NDArray[np.float64]:
    """Distance from inside to a sphere around the origin, along every ray."""
    origin, ray = camera.rays()
    b = (origin * ray).sum(-1)
    return np.asarray(-b + np.sqrt(b * b - (origin**2).sum(-1) + radius**2))


def angles(a: NDArray[np.float32], b: NDArray[np.float64]) -> NDArray[np.float64]:
    cross = np.linalg.norm(np.cross(a, b), axis=-1)
    return np.asarray(np.degrees(np.arctan2(cross, (a * b).sum(-1))))


def sampled(camera: Camera) -> NDArray[np.bool_]:
    return np.asarray(np.any(camera.lens_table() != 0, axis=-1))


def trace(volume: Volume, camera: Camera) -> NDArray[np.float64]:
    """Walk all rays in 0.05 mm steps to the first tissue; inf where there is none."""
    origin, ray = camera.rays()
    depth = np.full(ray.shape[:2], np.inf)
    for t in np.arange(0.0, 22.0, 0.05):
        met = (volume.sample(origin + t * ray) > 0) & ~np.isfinite(depth)
        depth[met] = t - 0.025
    return depth


@pytest.fixture(scope="module")
def inside(hollow: Volume) -> SurfelRasterizer:
    return SurfelRasterizer(hollow)


@pytest.mark.parametrize("projection", [Projection.EQUIDISTANT, Projection.PERSPECTIVE])
@given(eye=EYES)
def test_a_sphere_seen_from_inside(
    inside: SurfelRasterizer,
    pool: ThreadPool,
    projection: Projection,
    eye: tuple[float, float, float],
) -> None:
    camera = view(eye, (0.0, 4.0, 0.5), projection=projection)
    g = inside.draw(camera, pool)
    seen = sampled(camera)
    assert np.all(g.coverage[seen] == 1), "no holes"
    assert np.all(g.coverage[~seen] == 0)
    assert np.all(np.isinf(g.depth_mm[~seen]))
    depth = sphere_depth(camera, 6.0)
    error = (g.depth_mm - depth)[seen]
    # the trilinear field itself is off by h^2 / (4 R) = 10 um
    assert np.abs(error).mean() < 0.02
    assert np.abs(error).max() < 0.15
    origin, ray = camera.rays()
    truth = -(origin + depth[..., None] * ray)
    off = angles(g.normal[seen], truth[seen])
    assert off.mean() < 1.0
    assert off.max() < 6.0
    np.testing.assert_allclose(np.linalg.norm(g.normal[seen], axis=-1), 1, atol=1e-5)


@given(
    tilt=st.floats(-0.9, 0.9),
    distance=st.floats(1.0, 13.0),
    projection=st.sampled_from([Projection.EQUIDISTANT, Projection.PERSPECTIVE]),
)
def test_depth_is_exact_on_a_plane(
    pool: ThreadPool, tilt: float, distance: float, projection: Projection
) -> None:
    """Also where fine elements (nearer than 12 mm) hand over to coarse ones."""
    k = np.indices((11, 49, 49))[0] * 0.5
    volume = Volume(
        (2.0 - k).astype(np.float32), np.full(3, 0.5), np.array([-12.0, -12.0, 0.0])
    )
    eye = (0.0, 0.0, 2.0 + distance)
    camera = Camera.looking_at(
        eye,
        (math.tan(tilt) * distance, 0.0, 2.0),
        up=(0, 1, 0),
        extent=0.5,
        size=(64, 48),
        projection=projection,
    )
    g = SurfelRasterizer(volume).draw(camera, pool)
    origin, ray = camera.rays()
    with np.errstate(divide="ignore", invalid="ignore"):
        depth = -distance / ray[..., 2]
        met = origin + depth[..., None] * ray
    on_plane = sampled(camera) & (depth > 0) & np.all(np.abs(met[..., :2]) < 11, -1)
    assert np.all(g.coverage[on_plane] == 1)
    np.testing.assert_allclose(g.depth_mm[on_plane], depth[on_plane], rtol=2e-5)
    assert angles(g.normal[on_plane], np.array([0.0, 0, 1])).max() < 0.01


def test_bits_do_not_depend_on_the_number_of_threads(
    hollow: Volume, bars: Volume, camera: Camera, pool: ThreadPool, three: ThreadPool
) -> None:
    """With rims that are sharpened, and beside a cut."""
    cut = Cut(np.array([4.8, 0.0, 0.0]), 2.9, np.array([0.0, 1.0, 0.0]), 0.8)
    for drawer, seen in (
        (SurfelRasterizer(hollow), view((1.0, -2.0, 0.5), (0.0, 4.0, 0.0), (300, 130))),
        (SurfelRasterizer(bars), camera),
        (
            SurfelRasterizer(hollow, deflection=Deflection((cut,))),
            view((0.5, -1, 0.3), (6, 0.2, 0)),
        ),
    ):
        alone = drawer.draw(seen, pool)
        for _ in range(5):
            assert same(drawer.draw(seen, three), alone)


def test_a_picture_repeats_after_another_one(
    inside: SurfelRasterizer, pool: ThreadPool
) -> None:
    camera = view((1.0, -2.0, 0.5), (0.0, 4.0, 0.0))
    first = inside.draw(camera, pool)
    inside.draw(view((0.0, 0.0, 1.0), (0.0, -4.0, 0.0), (50, 70)), pool)
    assert same(first, inside.draw(camera, pool))


def test_a_hole_stays_open_and_depth_agrees_with_ray_casting(
    cavities: Volume, pool: ThreadPool
) -> None:
    camera = view((-4.5, 0.3, 0.2), (5.0, 0.0, 0.0), (80, 80))
    g = SurfelRasterizer(cavities).draw(camera, pool)
    depth = trace(cavities, camera)
    seen = sampled(camera)
    assert np.all(g.coverage[seen] == 1)
    through = seen & (depth > 8)
    assert through.sum() > 100, "the far cavity is in view"
    assert np.mean(g.depth_mm[through] > 7) > 0.85
    off = np.abs(g.depth_mm[seen] - depth[seen])
    assert np.mean(off > 1) < 0.02
    assert np.median(off) < 0.03


def test_leaving_hidden_blocks_out_changes_no_bit(
    cavities: Volume, pool: ThreadPool
) -> None:
    bare = SurfelRasterizer(cavities, hide=False)
    hiding = SurfelRasterizer(cavities)
    hidden = 0
    for target in ((-5.0, 5.0, 0.0), (5.0, 0.0, 0.0), (5.0, 6.0, 2.0)):
        camera = view((-6.5, -0.4, 0.3), target)
        assert same(bare.draw(camera, pool), hiding.draw(camera, pool))
        hidden += hiding.counters["hidden blocks"]
        assert hiding.counters["listed"] <= bare.counters["listed"]
    assert hidden > 0


@pytest.mark.parametrize("gap", [0.3, 0.05])
def test_a_camera_at_the_wall_sees_a_finite_picture(
    inside: SurfelRasterizer, pool: ThreadPool, gap: float
) -> None:
    camera = view((6.0 - gap, 0.0, 0.0), (8.0, 0.0, 0.0))
    g = inside.draw(camera, pool)
    seen = sampled(camera)
    assert np.mean(g.coverage[seen]) > 0.98
    shown = g.coverage > 0
    assert np.all(np.isfinite(g.depth_mm[shown]))
    assert np.all(g.depth_mm[shown] > 0)
    assert g.depth_mm[48, 48] == pytest.approx(gap, abs=0.03)


def test_an_eye_in_tissue_looking_away_from_air_sees_nothing(
    inside: SurfelRasterizer, pool: ThreadPool
) -> None:
    g = inside.draw(view((6.8, 0.0, 0.0), (9.0, 0.0, 0.0)), pool)
    assert not g.coverage.any()
    assert np.all(np.isinf(g.depth_mm))


def test_anisotropic_spacing(pool: ThreadPool) -> None:
    h = np.array([0.4, 0.5, 0.8])
    shape = tuple(int(16 / s) + 1 for s in h[::-1])
    k, j, i = np.indices(shape)
    p = np.stack([i, j, k], -1) * h - 8.0
    volume = Volume(
        (np.linalg.norm(p, axis=-1) - 6).astype(np.float32), h, np.full(3, -8.0)
    )
    camera = view((0.5, -1.0, 0.3), (0.0, 4.0, 1.0))
    g = SurfelRasterizer(volume).draw(camera, pool)
    seen = sampled(camera)
    assert np.all(g.coverage[seen] == 1)
    assert np.abs(g.depth_mm - sphere_depth(camera, 6.0))[seen].mean() < 0.05


def test_orthographic_cameras_are_turned_down(
    inside: SurfelRasterizer, pool: ThreadPool
) -> None:
    camera = view((0, 0, 0), (0, 1, 0), projection=Projection.ORTHOGRAPHIC)
    with pytest.raises(ValueError, match="eye point"):
        inside.draw(camera, pool)


@pytest.mark.parametrize("refresh", [1, 7, 1 << 30])
def test_leaving_out_what_is_behind_changes_no_bit(
    cavities: Volume, pool: ThreadPool, monkeypatch: pytest.MonkeyPatch, refresh: int
) -> None:
    """However often tiles look what is hidden by now, or never, and over all views."""
    rasterizer = SurfelRasterizer(cavities)
    rng = np.random.default_rng(5)
    for eye, target, (width, height) in (
        ((-6.5, -0.4, 0.3), (5.0, 0.0, 0.0), (150, 101)),
        ((-4.5, 0.3, 0.2), (5.0, 6.0, 2.0), (64, 64)),
        ((6.2, 0.1, -0.3), (-5.0, 0.4, 0.0), (67, 130)),
    ):
        towards = np.array(target) + rng.normal(size=3)
        # few pixels: discs that are barely one wide are left out and met at random
        camera = Camera.looking_at(eye, towards, size=(width // 3, height // 3))
        usual = rasterizer.draw(camera, pool)
        with monkeypatch.context() as patch:
            patch.setattr("renderers.fsr.surfels.surfel_rasterizer.REFRESH", refresh)
            other = rasterizer.draw(camera, pool)
        for name in ("depth_mm", "normal", "coverage"):
            np.testing.assert_array_equal(getattr(usual, name), getattr(other, name))
