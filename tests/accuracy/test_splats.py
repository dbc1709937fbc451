"""Mode `classic` of the fuzzy-set renderer against closed forms.

Bounds are those of splatting by this footprint: a lattice of Gaussians ripples by
``8 exp(-2 (pi s)^2)`` at a sigma of s spacings, and a footprint cut at three sigma by a
little more.
"""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from renderers.fsr import Inclusion, extract_fuzzy_set
from renderers.fsr.kernels.footprint import SIGMA_PER_SPACING
from renderers.fsr.splats import SplatMode, SplatRasterizer
from renderers.fsr.splats.shaded_set import ShadedSet
from renderers.scene import (
    Camera,
    Light,
    PhongMaterial,
    Projection,
    Scene,
    TransferFunction,
    Volume,
)
from renderers.scene.thread_pool import ThreadPool

POOL = ThreadPool(2)
PLAIN = PhongMaterial(ambient=1.0, diffuse=0.0)
CODE = 1 / 255


def drawer_of(volume: Volume, kappa: float, *, smooth: bool = False) -> SplatRasterizer:
    """Splat a volume's voxels from 50 on with one extinction, or one in proportion."""
    nodes = [0.0, 100.0] if smooth else [49.0, 50.0]
    transfer = TransferFunction(np.array(nodes), np.ones((2, 3)), np.array([0, kappa]))
    scene = Scene(volume, transfer, lights=(), material=PLAIN)
    least = 1e-3 if smooth else 50.0
    fuzzy = extract_fuzzy_set(volume, Inclusion.density(0, 100), least)
    return SplatRasterizer(fuzzy, scene, least_light=0.0)


def block(
    shape: tuple[int, int, int],
    spacing: tuple[float, float, float] = (1, 1, 1),
    direction: NDArray[np.float64] | None = None,
) -> Volume:
    """Fill a volume around the origin."""
    axes = np.eye(3) if direction is None else direction
    half = (np.array(shape[::-1]) - 1) / 2 * spacing
    values = np.full(shape, 100, np.float32)
    return Volume(values, np.array(spacing), -axes @ half, axes)


def flat_view(
    towards: NDArray[np.float64], half_mm: float, size: int, roll: float = 0.0
) -> Camera:
    """Look at the origin from 100 mm away, along `towards`."""
    forward = towards / np.linalg.norm(towards)
    side = np.eye(3)[np.argmin(np.abs(forward))]
    up = math.cos(roll) * side + math.sin(roll) * np.cross(forward, side)
    return Camera.looking_at(
        -100 * forward,
        (0, 0, 0),
        up=up,
        extent=half_mm,
        size=(size, size),
        projection=Projection.ORTHOGRAPHIC,
    )


def mean_and_ripple(
    drawer: SplatRasterizer, camera: Camera, mode: SplatMode
) -> tuple[float, float]:
    alpha = drawer.draw(camera, POOL, mode).rgba[..., 3].astype(np.float64)
    return float(alpha.mean()), float(np.ptp(alpha))


def test_a_uniform_box_of_32_mm() -> None:
    """Opacity .05 per mm: .8063 straight through, to each mode's own bound."""
    drawer = drawer_of(block((32, 40, 40)), 0.051293294387551)
    camera = flat_view(np.array([0.0, 0.0, 1.0]), 8.0, 128)
    truth = 0.806288515541499
    mean, ripple = mean_and_ripple(drawer, camera, SplatMode.GAUSSIAN)
    assert mean == pytest.approx(truth, rel=0.02)
    assert ripple <= 6 * CODE
    mean, _ = mean_and_ripple(drawer, camera, SplatMode.POINTS)
    assert mean == pytest.approx(truth, rel=0.05)


def test_the_box_seen_at_35_degrees() -> None:
    """A ray through the same two faces is longer by 1 / cos: .8652."""
    drawer = drawer_of(block((32, 90, 60)), 0.051293294387551)
    angle = math.radians(35)
    camera = flat_view(np.array([0.0, math.sin(angle), math.cos(angle)]), 6.0, 96)
    truth = 0.865172839254449
    mean, ripple = mean_and_ripple(drawer, camera, SplatMode.GAUSSIAN)
    assert mean == pytest.approx(truth, rel=0.02)
    assert ripple <= 6 * CODE


@pytest.mark.parametrize("q", [0.3, 0.7, 0.95])
def test_one_sheet_has_the_opacity_it_should(q: float) -> None:
    """.3000, .7000, .9500."""
    volume = block((2, 40, 40), (1, 1, 1))
    values = volume.values.copy()
    values[1] = 0
    drawer = drawer_of(volume.with_values(values, 0.0), -math.log1p(-q))
    camera = flat_view(np.array([0.0, 0.0, 1.0]), 8.0, 160)
    # naive peaks give .522, .866 and .959, and ripples of .011, .035 and .047
    mean, ripple = mean_and_ripple(drawer, camera, SplatMode.GAUSSIAN)
    assert mean == pytest.approx(q, abs=2e-3)
    assert ripple < 0.05


def test_an_opaque_wall_lets_nothing_through() -> None:
    drawer = drawer_of(block((8, 40, 40)), 12.0)
    alpha = drawer.draw(flat_view(np.array([0.0, 0.0, 1.0]), 8.0, 128), POOL).rgba
    assert alpha[..., 3].min() >= 0.99
    assert np.ptp(alpha[..., 3]) < CODE


@pytest.mark.parametrize("kappa", [0.05, 0.4])
@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize(
    ("name", "direction"),
    [
        ("straight", np.eye(3)),
        ("permuted", np.eye(3)[[1, 2, 0]]),
        ("mirrored", np.diag([1.0, -1.0, 1.0])),
        ("turned", np.linalg.qr(np.random.default_rng(4).normal(size=(3, 3)))[0]),
    ],
)
def test_spacing_and_direction_change_no_opacity(
    name: str, direction: NDArray[np.float64], axis: int, kappa: float
) -> None:
    """Voxels of .4 x .4 x 2 mm, seen along each of the grid's axes."""
    spacing = (0.4, 0.4, 2.0)
    counts = [46, 46, 12]
    counts[axis] = 8
    drawer = drawer_of(
        block((counts[2], counts[1], counts[0]), spacing, direction), kappa
    )
    camera = flat_view(direction[:, axis], 3.2, 96)
    truth = -math.expm1(-kappa * 8 * spacing[axis])
    mean, _ = mean_and_ripple(drawer, camera, SplatMode.GAUSSIAN)
    assert mean == pytest.approx(truth, rel=0.02), name


def test_a_sphere_hides_what_it_should_of_a_window() -> None:
    """R = 8, kappa = .1: .3161 over 20 x 20 mm."""
    h = 0.5
    k, j, i = (np.indices((40, 40, 40)) - 19.5) * h
    inside = np.where(i * i + j * j + k * k < 64, 100, 0).astype(np.float32)
    drawer = drawer_of(Volume(inside, np.full(3, h), np.full(3, -19.5 * h)), 0.1)
    camera = flat_view(np.array([0.3, 0.5, 1.0]), 10.0, 160)
    mean, _ = mean_and_ripple(drawer, camera, SplatMode.GAUSSIAN)
    assert mean == pytest.approx(0.316095643633788, rel=0.02)


@pytest.mark.parametrize("projection", [Projection.EQUIDISTANT, Projection.PERSPECTIVE])
def test_a_shell_looks_the_same_in_all_directions_from_its_middle(
    projection: Projection,
) -> None:
    """6 to 8 mm, kappa = .1: .1813."""
    h = 0.4
    k, j, i = (np.indices((44, 44, 44)) - 21.5) * h
    r2 = i * i + j * j + k * k
    shell = np.where((r2 > 36) & (r2 < 64), 100, 0).astype(np.float32)
    drawer = drawer_of(Volume(shell, np.full(3, h), np.full(3, -21.5 * h)), 0.1)
    for target in ((1, 0, 0), (1, 2, 3), (-2, 1, 0)):
        camera = Camera.looking_at(
            (0, 0, 0), target, extent=0.6, size=(64, 64), projection=projection
        )
        alpha = drawer.draw(camera, POOL).rgba[16:48, 16:48, 3]
        assert alpha.mean() == pytest.approx(0.181269246922018, rel=0.02)


def test_a_turntable_of_360_views_does_not_pop() -> None:
    """A quarter of a degree from view to view, across 45 degrees."""
    rng = np.random.default_rng(5)
    values = rng.uniform(0, 100, (8, 8, 8)).astype(np.float32)
    drawer = drawer_of(Volume(values, np.ones(3), np.full(3, -3.5)), -math.log(0.65))
    steps = []
    last = None
    for angle in np.radians(np.arange(360) * 0.25):
        eye = 30 * np.array([math.sin(angle), -math.cos(angle), 0.1])
        camera = Camera.looking_at(
            eye, (0, 0, 0), extent=0.2, size=(64, 64), projection=Projection.PERSPECTIVE
        )
        rgba = drawer.draw(camera, POOL).rgba
        if last is not None:
            steps.append(float(np.sqrt(np.mean((rgba - last) ** 2))))
        last = rgba
    assert max(steps) <= 3 * np.median(steps)


@pytest.mark.parametrize(
    ("r", "degrees", "bound"),
    [
        *[(0.02, 0, 0.0004), (0.02, 20, 0.009), (0.02, 40, 0.020)],
        *[(0.05, 0, 0.003), (0.05, 20, 0.024), (0.05, 40, 0.051)],
        *[(0.095, 0, 0.011), (0.095, 20, 0.052), (0.095, 40, 0.106)],
    ],
)
def test_a_footprint_made_straight_differs_little(
    r: float, degrees: float, bound: float
) -> None:
    """A Gaussian's optical depth along rays falls with their distance from its middle.

    r: its sigma over its distance. From .1 on it is subdivided. On top of the bound the
    footprint is cut, and softened by a third of a pixel.
    """
    values = np.zeros((3, 3, 3), np.float32)
    values[1, 1, 1] = 100
    sigma = SIGMA_PER_SPACING
    distance = sigma / r
    angle = math.radians(degrees)
    eye = -distance * np.array([math.sin(angle), math.cos(angle), 0.0])
    camera = Camera.looking_at(
        eye,
        eye + np.array([0, 1.0, 0]),
        extent=math.radians(55),
        size=(700, 700),
        projection=Projection.PERSPECTIVE,
    )
    drawer = drawer_of(Volume(values, np.ones(3), np.full(3, -1.0)), 1e-4)
    alpha = drawer.draw(camera, POOL).rgba[..., 3].astype(np.float64)
    assert drawer.counters["subdivided"] == 0
    _, rays = camera.rays()
    aside = np.cross(rays, -eye)
    exact = np.exp(-0.5 * (aside**2).sum(-1) / sigma**2)
    edge = math.exp(-4.5)
    exact = np.maximum(exact - edge, 0) / (1 - edge)
    # along an oblique ray the depth is the same: a ball has no direction
    assert np.abs(alpha / alpha.max() - exact).max() < bound + 0.012


def test_a_blob_keeps_its_optical_depth_at_an_eighth_of_the_size() -> None:
    """Gaussian, sigma 3 mm: the integral over the picture, at 160 and 20 pixels."""
    k, j, i = np.indices((25, 25, 25)) - 12.0
    r2 = i * i + j * j + k * k
    values = (100 * np.exp(-r2 / 18)).astype(np.float32)
    drawer = drawer_of(Volume(values, np.ones(3), np.full(3, -12.0)), 0.4, smooth=True)
    sums = []
    for size in (160, 20):
        camera = flat_view(np.array([0.2, 0.1, 1.0]), 16.0, size)
        alpha = drawer.draw(camera, POOL).rgba[..., 3]
        depth = -np.log1p(-alpha.astype(np.float64))
        sums.append(depth.sum() * (32 / size) ** 2)
    assert sums[1] == pytest.approx(sums[0], rel=0.01)
    assert sums[0] == pytest.approx(0.4 * (2 * math.pi * 9) ** 1.5, rel=0.01)


def test_a_lit_sphere_follows_lambert() -> None:
    """R = 8 voxels and an edge of one: each splat's shade within .02 of n.l."""
    k, j, i = np.indices((25, 25, 25)) - 12.0
    r = np.sqrt(i * i + j * j + k * k)
    fall = np.vectorize(math.erf)((8 - r) / math.sqrt(2))
    volume = Volume((50 * (1 + fall)).astype(np.float32), np.ones(3), np.full(3, -12.0))
    light = np.array([0.36, 0.48, 0.8])
    scene = Scene(
        volume,
        TransferFunction(np.array([0.0, 100.0]), np.ones((2, 3)), np.array([0, 1.0])),
        lights=(Light(light, np.ones(3)),),
        material=PhongMaterial(ambient=0.0, diffuse=1.0),
    )
    fuzzy = extract_fuzzy_set(volume, Inclusion.density(0, 100), 30.0)
    shades = ShadedSet(fuzzy, scene).splats.colors[:, 0]
    place = fuzzy.rows.centers_mm()
    radius = np.linalg.norm(place, axis=1)
    facing = place @ light / np.maximum(radius, 1e-9)
    tested = (np.abs(radius - 8) < 0.7) & (facing > 0.2)
    assert tested.sum() > 200
    assert np.abs(shades - facing)[tested].max() <= 0.02
