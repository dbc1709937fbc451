"""Splats at the edges of what can be asked of mode `classic`."""

import hashlib
import math
import tracemalloc

import numpy as np
import pytest

from renderers.fsr import Inclusion, extract_fuzzy_set, update_fuzzy_set
from renderers.fsr.splats import SplatMode, SplatRasterizer
from renderers.scene import (
    Camera,
    Image,
    PhongMaterial,
    Projection,
    Scene,
    TransferFunction,
    Volume,
)
from renderers.scene.thread_pool import ThreadPool
from tests.renderers.fsr.plain_footprint import gaussian_footprint

POOL = ThreadPool(2)
ALONE = ThreadPool(1)


def scene_of(volume: Volume, kappa: float) -> Scene:
    transfer = TransferFunction(
        np.array([49.0, 50.0]), np.ones((2, 3)), np.array([0, kappa])
    )
    plain = PhongMaterial(ambient=1.0, diffuse=0.0)
    return Scene(volume, transfer, lights=(), material=plain)


def drawer_of(
    volume: Volume, kappa: float, *, least: float = 50.0, least_light: float = 0.0
) -> SplatRasterizer:
    scene = scene_of(volume, kappa)
    fuzzy = extract_fuzzy_set(volume, Inclusion.density(0, 100), least)
    return SplatRasterizer(fuzzy, scene, least_light=least_light)


def full(shape: tuple[int, int, int]) -> Volume:
    """Fill a volume around the origin."""
    half = (np.array(shape[::-1]) - 1) / 2
    return Volume(np.full(shape, 100, np.float32), np.ones(3), -half)


def from_above(half_mm: float, size: int) -> Camera:
    return Camera.looking_at(
        (0, 0, 4e3),
        (0, 0, 0),
        up=(0, 1, 0),
        extent=half_mm,
        size=(size, size),
        projection=Projection.ORTHOGRAPHIC,
    )


def bits(image: Image) -> str:
    return hashlib.sha256(image.rgba.tobytes()).hexdigest()


@pytest.mark.parametrize("mode", SplatMode)
@pytest.mark.parametrize("projection", Projection)
def test_an_empty_set_is_background(mode: SplatMode, projection: Projection) -> None:
    drawer = drawer_of(full((4, 4, 4)), 1.0, least=101.0)
    camera = Camera.looking_at(
        (0, -9, 0), (0, 0, 0), extent=1.0, size=(40, 70), projection=projection
    )
    image = drawer.draw(camera, POOL, mode, with_depth=True)
    assert not image.rgba.any()
    assert image.depth_mm is not None
    assert np.all(np.isposinf(image.depth_mm))


@pytest.mark.parametrize(
    ("opacity", "bound"), [(1e-5, 1e-4), (1e-4, 1e-4), (1 / 255, 6e-6)]
)
def test_65536_faint_splats_on_one_pixel(opacity: float, bound: float) -> None:
    """A column of voxels inside one pixel of 80 mm, against float64."""
    scale = 1 / 80
    variance = (0.6 * scale) ** 2 + 0.3
    # the extinction that calls for that peak: a lattice of such splats is as deep
    phase = (np.arange(12) + 0.5) / 12 - np.arange(-3, 4)[:, None]
    apart = phase[:, None, :, None] ** 2 + phase[None, :, None, :] ** 2
    lattice = opacity * gaussian_footprint(apart / 0.6**2).reshape(49, 144)
    depth = -math.log(np.exp(np.log1p(-lattice).sum(axis=0)).mean())
    kappa = depth * variance / (0.6 * scale) ** 2
    drawer = drawer_of(full((256, 16, 16)), kappa)
    alpha = float(drawer.draw(from_above(40.0, 1), POOL).rgba[0, 0, 3])
    assert drawer.counters["visible"] == 65536
    aside = (np.arange(16) - 7.5) * scale
    weight = gaussian_footprint((aside[:, None] ** 2 + aside**2) / variance)
    truth = -math.expm1(256 * np.log1p(-opacity * weight).sum())
    assert abs(alpha - truth) < bound


@pytest.mark.parametrize("mode", SplatMode)
def test_a_million_splats_off_the_picture_cost_rows_only(mode: SplatMode) -> None:
    drawer = drawer_of(full((100, 100, 100)), 1.0)
    for eye, target in (((0, -90, 0), (0, -200, 0)), ((0, -90, 0), (400, -90, 0))):
        camera = Camera.looking_at(
            eye, target, extent=0.5, size=(64, 64), projection=Projection.PERSPECTIVE
        )
        assert not drawer.draw(camera, POOL, mode).rgba.any()
        assert drawer.counters["listed"] == 0
        assert drawer.counters["culled rows"] == drawer.counters["rows"]
        assert not drawer.draw(camera, ALONE, mode).rgba.any()
        assert drawer.counters["culled rows"] == drawer.counters["rows"] == 10_000
        assert drawer.counters["fragments"] == 0


def test_a_million_splats_off_the_picture_take_no_memory() -> None:
    """Beyond the picture itself, a fraction of a byte a splat, whatever its size."""
    drawer = drawer_of(full((100, 100, 100)), 1.0)
    for size in (64, 512):
        camera = Camera.looking_at(
            (0, -90, 0), (0, -200, 0), extent=0.5, size=(size, size)
        )
        drawer.draw(camera, POOL)
        tracemalloc.start()
        drawer.draw(camera, POOL)
        _, most = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        # each thread's strip has a list of rows
        assert most - 16 * size**2 < 5e5 * POOL.threads


@pytest.mark.parametrize("mode", [SplatMode.POINTS, SplatMode.GAUSSIAN])
@pytest.mark.parametrize("size", [(64, 64), (75, 50), (200, 33)])
def test_a_splat_that_covers_the_picture_is_drawn_once_everywhere(
    mode: SplatMode, size: tuple[int, int]
) -> None:
    values = np.zeros((3, 3, 3), np.float32)
    values[1, 1, 1] = 100
    drawer = drawer_of(Volume(values, np.ones(3), np.full(3, -1.0)), 0.3)
    camera = Camera.looking_at(
        (0, 0, 50.0), (0, 0, 0), up=(0, 1, 0), extent=0.2, size=size,
        projection=Projection.ORTHOGRAPHIC,
    )  # fmt: skip
    shared = drawer.draw(camera, POOL, mode)
    image = drawer.draw(camera, ALONE, mode)
    assert image.rgba.tobytes() == shared.rgba.tobytes()
    assert drawer.counters["visible"] == 1
    if mode is SplatMode.GAUSSIAN:
        assert image.rgba[..., 3].min() > 0
        # counted in parts of 256, rounded down square by square
        assert drawer.counters["fragments"] >= size[0] * size[1] - 2
    assert 0 < drawer.counters["fragments"] <= size[0] * size[1]


@pytest.mark.parametrize("mode", SplatMode)
@pytest.mark.parametrize("projection", [Projection.EQUIDISTANT, Projection.PERSPECTIVE])
@pytest.mark.parametrize(
    "offset", [0.0, 1e-6, -1e-6, 0.01, 0.08, 0.3, 0.5, 1.0, -0.3, -1.0]
)
def test_a_splat_at_the_eye_leaves_a_finite_picture(
    offset: float, projection: Projection, mode: SplatMode
) -> None:
    """In the middle of a voxel, behind it, just before it, at the split's limits."""
    drawer = drawer_of(full((5, 5, 5)), 0.5)
    camera = Camera.looking_at(
        (0, -offset, 0), (0, 9, 0), extent=0.9, size=(70, 50), projection=projection
    )
    image = drawer.draw(camera, POOL, mode, with_depth=True)
    assert np.all(np.isfinite(image.rgba))
    assert 0 <= image.rgba[..., 3].min() <= image.rgba[..., 3].max() <= 1
    # parts of parts: eight for each of the nearest, and of their nearest
    assert drawer.counters["visible"] < 125 * 8**3


@pytest.mark.parametrize("thin_mm", [1e-3, 1e-4])
def test_flat_voxels_keep_their_footprint_and_mass(thin_mm: float) -> None:
    """Seen on edge their covariance is singular but for the least width of a pixel.

    Its condition is the square of a voxel's: up to 1e8, since flatter ones are refused.
    """
    values = np.full((40, 12, 12), 100, np.float32)
    origin = np.array([-5.5, -5.5, -19.5 * thin_mm])
    volume = Volume(values, np.array([1, 1, thin_mm]), origin)
    drawer = drawer_of(volume, 0.05e-3 / thin_mm)
    for towards in ((0.0, 1.0, 0.0), (0.0, 1.0, 1e-4), (1.0, 0.4, 1e-7)):
        camera = Camera.looking_at(
            -20 * np.array(towards),
            (0, 0, 0),
            extent=10.0,
            size=(160, 160),
            projection=Projection.ORTHOGRAPHIC,
        )
        alpha = drawer.draw(camera, POOL).rgba[..., 3]
        assert np.all(np.isfinite(alpha))
        depth = -np.log1p(-alpha.astype(np.float64)).sum() * (20 / 160) ** 2
        assert depth == pytest.approx(0.05 * 12 * 12 * 0.04, rel=0.02)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_voxels_that_are_no_numbers_are_refused(bad: float) -> None:
    values = full((4, 5, 6)).values.copy()
    values[1, 2, 3] = bad
    volume = Volume(values, np.ones(3), np.zeros(3))
    with pytest.raises(ValueError, match="1 of 120 voxels"):
        drawer_of(volume, 1.0)


@pytest.mark.parametrize("mode", SplatMode)
def test_a_slice_of_equal_depths_has_one_picture(mode: SplatMode) -> None:
    """Extracted whole or box by box in any order, drawn by one thread or by three."""
    rng = np.random.default_rng(1)
    values = np.zeros((2, 60, 60), np.float32)
    values[0] = rng.uniform(40, 100, (60, 60))
    volume = Volume(values, np.ones(3), np.array([-29.5, -29.5, 0]))
    scene = scene_of(volume, 2.0)
    inclusion = Inclusion.density(0, 100)
    seen = set()
    for threads in (1, 2, 3):
        pool = ThreadPool(threads)
        # splats arrive in an order of their own
        grown = np.zeros_like(values)
        fuzzy = extract_fuzzy_set(volume.with_values(grown, 0.0), inclusion, 50.0)
        for box in rng.permutation(9):
            j, i = 20 * (box // 3), 20 * (box % 3)
            here = (slice(0, 2), slice(j, j + 20), slice(i, i + 20))
            grown = grown.copy()
            grown[here] = values[here]
            so_far = volume.with_values(grown, 0.0)
            low, high = (0, int(j), int(i)), (2, int(j) + 20, int(i) + 20)
            fuzzy = update_fuzzy_set(fuzzy, so_far, inclusion, 50.0, low, high)
        for set_ in (fuzzy, extract_fuzzy_set(volume, inclusion, 50.0)):
            drawer = SplatRasterizer(set_, scene, least_light=0.0)
            seen.add(bits(drawer.draw(from_above(31.0, 130), pool, mode)))
        pool.close()
    assert len(seen) == 1


@pytest.mark.parametrize("opacity", [0.999999, 1.0])
def test_opacity_one_is_opaque_and_finite(opacity: float) -> None:
    kappa = -math.log1p(-min(opacity, 1 - 2**-24))
    drawer = drawer_of(full((6, 30, 30)), kappa)
    rgba = drawer.draw(from_above(8.0, 100), POOL).rgba
    assert np.all(np.isfinite(rgba))
    assert rgba[..., 3].min() >= 1 - 1e-5
    assert rgba[..., 3].max() <= 1


@pytest.mark.parametrize("pixels_per_mm", [0.05, 0.2, 0.5, 0.8])
def test_splats_below_half_a_pixel_keep_their_mass(pixels_per_mm: float) -> None:
    """Single voxels anywhere in a pixel; their optical depth within two percent."""
    rng = np.random.default_rng(3)
    values = np.zeros((30, 200, 200), np.float32)
    at = rng.integers(10, 190, (2000, 2))
    values[rng.integers(0, 30, 2000), at[:, 0], at[:, 1]] = 100
    count = np.count_nonzero(values)
    volume = Volume(values, np.ones(3), np.array([-99.6, -99.3, -15]))
    half_mm = 100.0
    size = round(2 * half_mm * pixels_per_mm)
    # each a thousand times what float32 can take from the light
    kappa = 1e-4 / pixels_per_mm**2
    drawer = drawer_of(volume, kappa)
    alpha = drawer.draw(from_above(half_mm, size), POOL).rgba[..., 3]
    depth = -np.log1p(-alpha.astype(np.float64)).sum() / pixels_per_mm**2
    assert depth == pytest.approx(kappa * count, rel=0.02)
