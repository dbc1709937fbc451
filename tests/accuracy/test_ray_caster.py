"""The ray tracer against closed forms, mode `classic`, quality `final`.

Scenes, and the tests that hold them to their values (millimetres, alpha unless said):

=====  ==================================================  ==========================
S1     uniform box of 32, straight and at 35 degrees       `test_uniform_box`
S2     uniform ball, off its silhouette                    `test_ball_and_shell`
S3     shell, from outside and from its centre             `test_ball_and_shell`,
                                                           `test_inside_a_shell`
S4     Gaussian blob                                       `test_blob`
S5     scalar ramp, extinction in proportion               `test_ramp`
S6     scalar ramp, jump of extinction and colour          `test_jump`
S10    colour along a uniform medium                       `test_ramp_of_colour`
S12    Marschner-Lobb's signal                             `test_marschner_lobb`
S13    the box with other spacings, axes, rotations        `test_uniform_box`
=====  ==================================================  ==========================

Also a million thin segments, and orders of convergence. S7 (opaque plane inside a
volume) and S9 (opaque ball under a head light) are in `test_ray_surfaces.py`. S8, a
slab in perspective, S11, the first hit on a ball, and S14, deflectors in a uniform
medium, are in `tests/renderers/art`; one ray's seven integrals in `test_integrator.py`.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from renderers.art import ActiveRayTracer, Quality
from renderers.scene import (
    Camera,
    PhongMaterial,
    Projection,
    Scene,
    TransferFunction,
    Volume,
)
from tests.accuracy.balls import distances, hounsfield
from tests.slow_cases import slow

PLAIN = PhongMaterial(1.0, 0.0, 0.0)
FINAL = Quality.named("final")
INTEGRATED = replace(FINAL, classification="integrated")
BOTH = pytest.mark.parametrize(
    "quality", [FINAL, INTEGRATED], ids=["post", "integrated"]
)
TURNED = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
AXES = {
    "straight": np.eye(3),
    "permuted": np.eye(3)[[1, 2, 0]],
    "mirrored": np.diag([1.0, -1, 1]),
    "turned": TURNED,
}


def scene_of(volume: Volume, nodes: object, kappa: object, gray: object = 1.0) -> Scene:
    """Classify without lights; one extinction and one gray a node."""
    at = np.asarray(nodes, float)
    color = np.broadcast_to(np.asarray(gray, float), at.shape)
    transfer = TransferFunction(
        at,
        np.repeat(color[:, None], 3, axis=1),
        np.broadcast_to(np.asarray(kappa, float), at.shape),
    )
    return Scene(volume, transfer, (), PLAIN)


def ramp(length_mm: int = 32, spacing_mm: float = 1.0) -> Volume:
    """Fill a box with its own depth, 0 at the front, along y."""
    n = round(length_mm / spacing_mm) + 1
    depth = np.arange(n, dtype=np.float32) * np.float32(spacing_mm)
    values = np.broadcast_to(depth[:, None], (n, n, n))
    half = (n - 1) / 2 * spacing_mm
    return Volume(
        np.ascontiguousarray(values),
        np.full(3, spacing_mm),
        np.array([-half, 0, -half]),
    )


def one_ray(
    scene: Scene,
    quality: Quality,
    eye: tuple[float, float, float] | NDArray[np.float64] = (0.1, -20.0, 0.2),
    towards: tuple[float, float, float] | NDArray[np.float64] = (0.0, 1.0, 0.0),
) -> NDArray[np.float32]:
    """Get one pixel, seen by parallel rays."""
    eye = np.asarray(eye, float)
    camera = Camera.looking_at(
        eye, eye + np.asarray(towards), extent=1e-3, size=(1, 1),
        projection=Projection.ORTHOGRAPHIC,
    )  # fmt: skip
    pixel: NDArray[np.float32] = (
        ActiveRayTracer(scene, quality, threads=1).render(camera).rgba[0, 0]
    )
    return pixel


@BOTH
@pytest.mark.parametrize("axes", AXES)
@pytest.mark.parametrize("spacing", [(1.0, 1.0, 1.0), (0.4, 0.4, 2.0)])
def test_uniform_box(
    axes: str, spacing: tuple[float, float, float], quality: Quality
) -> None:
    """S1, S13: opacity .05 a millimetre, whatever the grid."""
    direction, step = AXES[axes], np.array(spacing)
    shape = tuple(round(32 / s) + 1 for s in spacing[::-1])
    volume = Volume(
        np.zeros(shape, np.int16), step, direction @ np.full(3, -16.0), direction
    )
    scene = scene_of(volume, [-1, 1], -math.log1p(-0.05))
    forward, side = direction[:, 1], direction[:, 0]
    alpha = one_ray(scene, quality, -40 * forward + 0.1 * side, forward)[3]
    assert alpha == pytest.approx(0.806288515541499, abs=2e-5)
    angle = math.radians(35)
    slanted = math.cos(angle) * forward + math.sin(angle) * side
    alpha = one_ray(scene, quality, -40 * slanted, slanted)[3]
    assert alpha == pytest.approx(0.865172839254449, abs=2e-5)


STEP_AT_0 = [-0.01, 0.0]


@pytest.mark.parametrize("shell", [False, True])
def test_ball_and_shell(shell: bool) -> None:
    """S2, S3: a jump at 0 HU of a distance field, off the silhouettes."""
    h, kappa = 0.25, 0.1
    distance = distances(8.0, h)
    if shell:
        distance = np.minimum(distance, -distances(6.0, h))
    scene = scene_of(hounsfield(distance, h), STEP_AT_0, [0, kappa])
    for b in (0.0, 3.0, 4.0, 5.5, 6.1, 7.0):
        if shell and abs(b - 6) < 0.4:
            continue
        way = 2 * math.sqrt(64 - b * b)
        if shell and b < 6:
            way -= 2 * math.sqrt(36 - b * b)
        found = one_ray(scene, FINAL, (b, -20.0, 0.0))[3]
        # A step that straddles the jump counts wholly or not at all: second order in
        # nothing. At a quarter of a voxel two or four ends are off by up to half a
        # step each.
        ends = 4 if shell and b < 6 else 2
        most = ends * 0.5 * kappa * FINAL.step_voxels * h + 1e-4
        assert found == pytest.approx(-math.expm1(-kappa * way), abs=most)


@pytest.mark.parametrize("step", [1.0, 0.5, 0.25, 0.125])
def test_rays_that_graze_a_jump_err_in_a_thin_band_alone(step: float) -> None:
    """Between samples densities count as linear; a cap that is lower is not met.

    They leave the line by a step's square over 8 R, and where a step passes a voxel's
    face, at which their slope breaks by some 1/R a voxel, by a quarter of that break.
    In the band a ray may err by all there is, at any quality: pictures are right on the
    mean, and to their RMSE, but no bound holds for the single pixel at a silhouette.
    """
    radius, pixels, wide = 13.3, 192, 0.2
    index = np.indices((40, 40, 40)).astype(np.float64) - 19.6
    values = 1e3 * (radius - np.sqrt((index**2).sum(axis=0)))
    values = values.astype(np.float32)
    scene = scene_of(Volume(values, np.ones(3), np.full(3, -19.6)), STEP_AT_0, [0, 10])
    way = np.array([0.36, 0.8, 0.48])
    middle = radius * np.cross(way, [0.0, 0.0, 1.0]) / math.hypot(0.36, 0.8)
    camera = Camera.looking_at(
        middle - 60.0 * way, middle, extent=wide / 2, size=(pixels, pixels),
        projection=Projection.ORTHOGRAPHIC,
    )  # fmt: skip
    found, truth = (
        ActiveRayTracer(scene, Quality(h, 0.0, classification="integrated"), threads=1)
        .render(camera)
        .rgba[..., 3]
        for h in (step, 1 / 256)
    )
    off = np.abs(found - truth)
    band_mm = (off > 0.02).mean() * wide
    assert off.max() > 0.3
    assert band_mm <= (step**2 / 8.0 + step / 4.0) / radius
    # it is a silhouette: half of what is looked at
    assert 0.3 < truth.mean() < 0.7


def test_inside_a_shell() -> None:
    """S3 from its centre: the same in every direction."""
    h = 0.25
    distance = np.minimum(distances(8.0, h), -distances(6.0, h))
    scene = scene_of(hounsfield(distance, h), STEP_AT_0, [0, 0.1])
    rng = np.random.default_rng(0)
    for way in rng.normal(size=(12, 3)):
        camera = Camera.looking_at(
            np.zeros(3), way, extent=1e-3, size=(1, 1),
            projection=Projection.PERSPECTIVE,
        )  # fmt: skip
        found = ActiveRayTracer(scene, FINAL, threads=1).render(camera).rgba[0, 0, 3]
        assert found == pytest.approx(0.181269246922018, abs=6.5e-3)


def blob(spacing_mm: float) -> Scene:
    """Make S4: a Gaussian of 1000 HU and sigma 3 mm, extinction in proportion."""
    r = 8.0 - distances(8.0, spacing_mm)
    values = (1000 * np.exp(-(r**2) / 18)).astype(np.float32)
    volume = Volume(values, np.full(3, spacing_mm), np.full(3, -10.0))
    return scene_of(volume, [0, 1000], [0, 0.4])


@pytest.mark.parametrize(
    ("b", "alpha"),
    [(0.0, 0.950607363744698), (3.0, 0.838688222642285), (6.0, 0.334410587977183)],
)
@BOTH
def test_blob(b: float, alpha: float, quality: Quality) -> None:
    """S4, cut off at the cube's faces, which leaves a part in a thousand out."""
    found = one_ray(blob(0.25), replace(quality, cutoff=0.0), (b, -20.0, 0.0))[3]
    # What lies beyond 10 mm: 8.6e-4 of the depth.
    depth = -math.log1p(-alpha) * math.erf(10 / 3 / math.sqrt(2))
    assert found == pytest.approx(-math.expm1(-depth), abs=7e-4)


def test_blob_converges_with_the_grid_at_second_order() -> None:
    exact = 0.4 * 3 * math.sqrt(2 * math.pi) * math.erf(10 / 3 / math.sqrt(2))
    error = []
    for h in (2.0, 1.0, 0.5, 0.25):
        found = one_ray(blob(h), Quality(1 / 32 / h, 0.0), (0.4, -20.0, 0.3))[3]
        depth = exact * math.exp(-(0.4**2 + 0.3**2) / 18)
        error.append(abs(math.log1p(-float(found)) + depth))
    orders = np.log2(np.array(error[:-1]) / error[1:])
    assert orders[-1] == pytest.approx(2, abs=0.3)
    assert orders.mean() == pytest.approx(2, abs=0.3)


@BOTH
def test_ramp(quality: Quality) -> None:
    """S5: trilinear interpolation is exact on it."""
    scene = scene_of(ramp(), [0, 32], [0.02, 0.02 + 0.004 * 32])
    assert one_ray(scene, quality)[3] == pytest.approx(0.931983162897063, abs=2e-5)


@pytest.mark.parametrize("at", [*np.linspace(10, 11, 9).tolist(), 10.3, 10.49, 10.999])
def test_jump(at: float) -> None:
    """S6: the error is that of half a step, wherever the jump falls into it.

    None is left where the transfer function is integrated.
    """
    nodes = [0, at, np.nextafter(np.float32(at), np.float32(99)), 32]
    scene = scene_of(ramp(), nodes, [0.03, 0.03, 0.3, 0.3], [0.8, 0.8, 0.2, 0.2])
    front = -math.expm1(-0.03 * at)
    back = -math.expm1(-0.3 * (32 - at))
    exact = 0.8 * front + 0.2 * (1 - front) * back
    found = one_ray(scene, FINAL)
    # Classified at its middle, a step lies wholly on one side: half of it may be on the
    # wrong one. Light changes by .0132 with a millimetre of that; over all phases the
    # largest error is .00165 (measured).
    assert found[0] == pytest.approx(exact, abs=0.0132 * 0.25 / 2 + 1e-5)
    alpha = 1 - (1 - front) * (1 - back)
    assert found[3] == pytest.approx(alpha, abs=1e-3)
    for step in (0.25, 1.0, 4.0):
        quality = Quality(step, 0.0, classification="integrated")
        found = one_ray(scene, quality)
        assert found[0] == pytest.approx(exact, abs=2e-6)
        assert found[3] == pytest.approx(alpha, abs=2e-6)


@BOTH
def test_ramp_of_colour(quality: Quality) -> None:
    """S10: 1e-5 is the midpoint rule's own error."""
    scene = scene_of(ramp(30), [0, 30], 0.1, [0.2, 0.8])
    quality = replace(quality, cutoff=0.0)
    assert one_ray(scene, quality)[0] == pytest.approx(0.350212931632136, abs=1e-5)


def test_marschner_lobb() -> None:
    """S12: the error of trilinear values, by their place in the grid."""
    f, a = 6.0, 0.25

    def signal(
        x: NDArray[np.float64], y: NDArray[np.float64], z: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        r = np.sqrt(x**2 + y**2)
        wave = np.cos(2 * math.pi * f * np.cos(math.pi * r / 2))
        rise = 1 - np.sin(math.pi * z / 2) + a * (1 + wave)
        return np.asarray(rise / (2 * (1 + a)))

    points = np.random.default_rng(1).uniform(-1, 1, (3, 20_000))
    for n, rmse in ((40, 0.0354), (80, 0.0103), (160, 0.0026)):
        axis = np.linspace(-1, 1, n)
        values = signal(axis, axis[:, None], axis[:, None, None])
        volume = Volume(values.astype(np.float32), np.full(3, axis[1] + 1), -np.ones(3))
        error = volume.sample(points.T) - signal(*points)
        assert np.sqrt(np.mean(error**2)) == pytest.approx(rmse, rel=0.08)


@pytest.mark.parametrize("rise", [0.0, 0.004, 0.02])
def test_the_midpoint_rule_is_of_second_order(rise: float) -> None:
    """Opacity by an exponential; colour and extinction grow along the ray."""
    length = 32.0
    scene = scene_of(ramp(), [0, length], [0.05, 0.05 + rise * length], [0.2, 0.8])
    nodes, weights = np.polynomial.legendre.leggauss(80)
    s = (nodes + 1) * length / 2
    kappa, gray = 0.05 + rise * s, 0.2 + 0.6 * s / length
    light = gray * kappa * np.exp(-0.05 * s - rise * s**2 / 2)
    exact = float(weights @ light) * length / 2
    error = [
        abs(float(one_ray(scene, Quality(step, 0.0))[0]) - exact)
        for step in (4.0, 2.0, 1.0, 0.5)
    ]
    orders = np.log2(np.array(error[:-1]) / error[1:])
    assert orders == pytest.approx(2, abs=0.15)


@BOTH
@pytest.mark.parametrize("depth", [1e-6, *slow(1e-9, 0.1, 3.0)])
def test_a_million_steps_add_up(depth: float, quality: Quality) -> None:
    """Segments of opacity 1e-15 to 3e-6; six digits of their sum."""
    n = 4097
    volume = Volume(
        np.zeros((2, n, 2), np.int16), np.ones(3), np.array([-0.5, 0, -0.5])
    )
    scene = scene_of(volume, [-1, 1], depth / (n - 1), 0.5)
    found = one_ray(scene, replace(quality, step_voxels=1 / 256, cutoff=0.0))
    exact = -math.expm1(-depth)
    assert found[3] == pytest.approx(exact, rel=1e-6)
    assert found[0] == pytest.approx(exact / 2, rel=1e-6)
