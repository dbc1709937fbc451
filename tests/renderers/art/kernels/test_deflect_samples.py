"""Bent rays see what the reference's see, however and by whom they are cast."""

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from numpy.typing import NDArray

from renderers.art import ActiveRayTracer, Quality
from renderers.art.quality import ClassificationName
from renderers.reference import render_reference
from renderers.scene import (
    AirSurface,
    Camera,
    PhongMaterial,
    Projection,
    Scene,
    TransferFunction,
    Volume,
    image_error,
)
from renderers.scene.deflection import (
    Cut,
    Deflection,
    Deflector,
    Rotation,
    Scaling,
    Translation,
    deflected_scene,
)
from tests.accuracy.balls import distances, hounsfield
from tests.slow_cases import slow

FINE = Quality(1 / 8, 0.0)


def kinds(center: NDArray[np.float64], radius: float) -> dict[str, Deflection]:
    shift = np.array([0.4, -0.2, 0.1]) * radius
    axis = np.array([0.3, 1.0, 0.2])
    found: dict[str, tuple[Deflector, ...]] = {
        "pulled": (Translation(center, radius, shift),),
        "turned": (Rotation(center, radius, axis, 0.9),),
        "swollen": (Scaling(center, radius, 1.7),),
        "shrunk": (Scaling(center, radius, 0.55),),
        "cut": (Cut(center, radius, axis, 0.25 * radius),),
        "chain": (
            Rotation(center, radius, axis, -0.6),
            Translation(center + 0.3 * radius, 0.7 * radius, -0.5 * shift),
        ),
    }
    return {name: Deflection(each) for name, each in found.items()}


NAMES = ("pulled", "turned", "swollen", "shrunk", "cut", "chain")


KINDS = ["integrated", pytest.param("post", marks=pytest.mark.slow)]
SLOW_PREVIEW = pytest.param("preview", marks=pytest.mark.slow)
"""Its compact volume has a march of its own: half a minute to compile."""


@pytest.mark.parametrize("name", ["cut", "chain", *slow(*NAMES[:4])])
@pytest.mark.parametrize("lit", [True, pytest.param(False, marks=pytest.mark.slow)])
def test_they_see_what_the_reference_sees(scene: Scene, name: str, lit: bool) -> None:
    """In a turned, anisotropic volume, lights and all; steps fine enough for both."""
    center = scene.volume.center_mm
    toward = np.array([26.0, -18.0, 10.0])
    deflection = kinds(center + 4 * toward / np.linalg.norm(toward), 8.0)[name]
    if not lit:
        scene = replace(scene, lights=(), material=PhongMaterial(1.0, 0.0))
    camera = Camera.looking_at(
        center + toward,
        center,
        extent=0.3,
        size=(21, 18),
        projection=Projection.PERSPECTIVE,
    )
    step = FINE.step_voxels * float(scene.volume.spacing_mm.min()) / 2
    wanted = render_reference(scene, camera, step, deflection=deflection)
    found = ActiveRayTracer(scene, FINE, deflection=deflection).render(camera).rgba
    still = ActiveRayTracer(scene, FINE).render(camera).rgba
    error, moved = found - wanted, still - wanted
    assert math.sqrt((moved**2).mean()) > 0.02, "it moves"
    # the extinction jumps: 1.5e-4 was measured, 2.5e-4 with the cut
    assert math.sqrt((error**2).mean()) < 5e-4
    assert np.abs(error).max() < 0.01


def uniform(kappa: float = 0.051293294387551) -> Scene:
    """S1: a box of 32 mm of one medium, opacity .05 a millimetre."""
    values = np.full((33, 33, 33), 100, np.int16)
    volume = Volume(values, np.ones(3), np.full(3, -16.0))
    transfer = TransferFunction(
        np.array([0.0, 200.0]), np.ones((2, 3)), np.full(2, kappa)
    )
    return Scene(volume, transfer, ())


@pytest.mark.parametrize("name", [n for n in NAMES if n != "cut"])
@pytest.mark.parametrize("quality", ["final", SLOW_PREVIEW])
@pytest.mark.parametrize("kind", KINDS)
def test_a_uniform_medium_stays_what_it_is(
    name: str, quality: str, kind: ClassificationName
) -> None:
    """S14: whatever is done inside the box, for every ray, to 20 roundings."""
    scene = uniform()
    camera = Camera.looking_at(
        (3.0, -60.0, 8.0),
        (1.0, 0.0, 0.0),
        extent=0.3,
        size=(31, 31),
        projection=Projection.PERSPECTIVE,
    )
    quality_ = replace(Quality.named(quality), cutoff=0.0, classification=kind)
    deflection = kinds(np.array([0.5, 1.0, -0.3]), 13.0)[name]
    straight = ActiveRayTracer(scene, quality_).render(camera).rgba
    tracer = ActiveRayTracer(scene, quality_, deflection=deflection)
    found = tracer.render(camera).rgba
    assert tracer.report is not None
    assert tracer.report.counters["deflected"] > 1000
    assert np.abs(found - straight).max() <= 20 * 2.0**-23


@pytest.mark.parametrize("off", [0.0, 0.21, 0.5])
@pytest.mark.parametrize("kind", KINDS)
def test_a_cut_takes_as_much_as_its_gap_is_wide(
    off: float, kind: ClassificationName
) -> None:
    """``1 - exp(-kappa (L - gap))`` along the normal, wherever steps end."""
    pull, radius = 2.0, 9.0
    cut = Cut(np.array([0.0, off, 0.0]), radius, np.array([0.0, 1.0, 0.0]), pull)
    half = pull
    for _ in range(200):
        half = pull * (1 - (half / radius) ** 2) ** 2
    camera = Camera.looking_at(
        (0.0, -60.0, 0.0),
        (0.0, 0.0, 0.0),
        extent=0.02,
        size=(9, 9),
        projection=Projection.ORTHOGRAPHIC,
    )
    for step, bound in ((1.0, 2e-3), (0.125, 5e-5)):
        tracer = ActiveRayTracer(
            uniform(),
            Quality(step, 0.0, classification=kind),
            deflection=Deflection((cut,)),
        )
        alpha = tracer.render(camera).rgba[4, 4, 3]
        wanted = -math.expm1(-0.051293294387551 * (32 - 2 * half))
        assert alpha == pytest.approx(wanted, abs=bound)


def test_rays_beside_the_balls_are_left_alone(scene: Scene, outside: Camera) -> None:
    """To the bit, and no place is sought by way of a deflector out of view."""
    center = scene.volume.center_mm
    straight = ActiveRayTracer(scene).render(outside).rgba
    here = Deflection((Scaling(center, 2.0, 1.6),))
    tracer = ActiveRayTracer(scene, deflection=here)
    found = tracer.render(outside).rgba
    assert tracer.report is not None
    some = tracer.report.counters["deflected"]
    off = np.linalg.norm(np.cross(outside.rays()[1], center - outside.eye_mm), axis=-1)
    beside = off > 2.01
    assert 0.5 < beside.mean() < 1
    assert_array_equal(found[beside], straight[beside])
    assert not np.array_equal(found, straight)
    assert some > 0
    away = Deflection((Scaling(center + 500.0, 2.0, 1.6),))
    tracer = ActiveRayTracer(scene, deflection=away)
    assert_array_equal(tracer.render(outside).rgba, straight)
    assert tracer.report is not None
    assert tracer.report.counters["deflected"] == 0
    assert_array_equal(
        ActiveRayTracer(scene, deflection=Deflection()).render(outside).rgba, straight
    )


def ball_scene(spacing: float = 0.5) -> Scene:
    """A ball of tissue of 6 mm in air."""
    at = np.arange(-10, 10 + spacing / 2, spacing)
    z, y, x = np.meshgrid(at, at, at, indexing="ij")
    values = (6 - np.sqrt(x * x + y * y + z * z)).astype(np.float32)
    distance = Volume(values, np.full(3, spacing), np.full(3, -10.0), background=1.0)
    tint = distance.with_values(np.zeros(values.shape, np.uint8), 0.0)
    nothing = TransferFunction(np.array([0.0, 1.0]), np.zeros((2, 3)), np.zeros(2))
    return Scene(distance, nothing, surface=AirSurface(distance, tint, tint))


def test_a_swollen_ball_has_the_radius_and_normals_it_should() -> None:
    """Swelling about its middle keeps it a ball: its radius solves r (1 + k w) = R."""
    factor, rim = 1.5, 9.0
    k = 1 / factor - 1
    r = 6.0
    for _ in range(500):
        r = 6 / (1 + k * (1 - (r / rim) ** 2) ** 2)
    camera = Camera.looking_at(
        (0.0, -30.0, 0.0), (0.0, 0.0, 0.0), extent=0.3, size=(64, 64)
    )
    deflection = Deflection((Scaling(np.zeros(3), rim, factor),))
    found = ActiveRayTracer(ball_scene(), "final", deflection=deflection).gbuffer(
        camera
    )
    origins, rays = camera.rays()
    along = (origins * rays).sum(-1)
    square = along**2 - (origins**2).sum(-1) + r * r
    deep = square > 4.0
    depth = -along - np.sqrt(np.maximum(square, 0))
    assert np.all(found.coverage[deep] == 1)
    off = found.depth_mm[deep] - depth[deep]
    # the interpolated ball is h^2 / (4 R), .01 mm, smaller; seen 1.2 times as large
    assert np.abs(off).max() < 0.04
    points = origins + depth[..., None] * rays
    cosine = (found.normal * points / r).sum(-1)[deep]
    assert np.degrees(np.arccos(np.clip(cosine, -1, 1))).mean() < 1.0


def test_a_cut_ball_gapes_with_flat_faces() -> None:
    """Looking along the cut, the gap is seen through; its faces stand across."""
    pull = 1.5
    cut = Cut(np.zeros(3), 9.0, np.array([1.0, 0.0, 0.0]), pull)
    camera = Camera.looking_at(
        (0.0, -30.0, 0.0),
        (0.0, 0.0, 0.0),
        extent=5.0,
        size=(101, 101),
        projection=Projection.ORTHOGRAPHIC,
    )
    tracer = ActiveRayTracer(ball_scene(), "final", deflection=Deflection((cut,)))
    found = tracer.gbuffer(camera)
    middle = found.depth_mm[50]
    x = camera.rays()[0][50, :, 0]
    # where the ball's far side begins, the gap is narrower than in the middle
    narrow = pull * (1 - (6 / 9) ** 2) ** 2
    assert np.all(np.isinf(middle[np.abs(x) < 0.8 * narrow]))
    assert np.all(np.isfinite(middle[(np.abs(x) > pull) & (np.abs(x) < 5)]))
    within = Camera.looking_at(
        (0.0, -3.0, 0.0), (1.0, -3.0, 0.0), extent=0.02, size=(9, 9)
    )
    hit = tracer.gbuffer(within)
    half = pull
    for _ in range(200):
        half = pull * (1 - (3.0**2 + half**2) / 81) ** 2
    assert hit.depth_mm[4, 4] == pytest.approx(half, abs=2e-3)
    # the gap narrows towards the rim: its face leans a little
    lean = 4 * pull / 81 * (1 - (3.0**2 + half**2) / 81)
    normal = np.array([-1 - lean * half, 3.0 * lean, 0.0])
    np.testing.assert_allclose(
        hit.normal[4, 4], normal / np.linalg.norm(normal), atol=5e-3
    )


@pytest.mark.parametrize("name", NAMES)
def test_surfaces_are_those_of_the_tissue_sampled_through_the_map(name: str) -> None:
    """Within what resampling the distance on its own grid costs."""
    scene = ball_scene()
    deflection = kinds(np.array([0.5, -3.0, 1.0]), 6.0)[name]
    camera = Camera.looking_at(
        (2.0, -30.0, 4.0), (0.0, 0.0, 0.0), extent=0.3, size=(96, 96)
    )
    bent = ActiveRayTracer(scene, "final", deflection=deflection).gbuffer(camera)
    sampled = ActiveRayTracer(deflected_scene(scene, deflection), "final").gbuffer(
        camera
    )
    both = np.isfinite(bent.depth_mm) & np.isfinite(sampled.depth_mm)
    either = np.isfinite(bent.depth_mm) | np.isfinite(sampled.depth_mm)
    assert both.sum() > 0.98 * either.sum()
    off = np.abs(bent.depth_mm[both] - sampled.depth_mm[both])
    assert np.median(off) < 0.02
    assert np.percentile(off, 95) < 0.25
    cosine = np.clip((bent.normal * sampled.normal).sum(-1)[both], -1, 1)
    assert np.median(np.degrees(np.arccos(cosine))) < 2.0


TOWARD = np.array([26.0, -18.0, 10.0])
AXIS = np.array([0.3, 1.0, 0.2])


def view(scene: Scene) -> Camera:
    """Look at the middle of the small scene, from a little way outside."""
    center = scene.volume.center_mm
    return Camera.looking_at(
        center + TOWARD,
        center,
        extent=0.3,
        size=(25, 22),
        projection=Projection.PERSPECTIVE,
    )


def found_by(
    scene: Scene,
    step: float,
    kind: ClassificationName,
    deflection: Deflection | None,
    camera: Camera,
) -> NDArray[np.float32]:
    quality = Quality(step, 0.0, classification=kind)
    return ActiveRayTracer(scene, quality, deflection=deflection).render(camera).rgba


@pytest.mark.parametrize("lit", [True, False])
def test_what_moves_nothing_changes_nothing(scene: Scene, lit: bool) -> None:
    """A pull of no length: all rays are bent ones, whose places are float64."""
    if not lit:
        scene = replace(scene, lights=(), material=PhongMaterial(1.0, 0.0))
    nothing = Deflection((Translation(scene.volume.center_mm, 30.0, np.zeros(3)),))
    camera = view(scene)
    quality = Quality(0.5, 0.0, classification="integrated")
    tracer = ActiveRayTracer(scene, quality, deflection=nothing)
    bent = tracer.render(camera)
    straight = ActiveRayTracer(scene, quality).render(camera)
    assert tracer.report is not None
    assert (
        tracer.report.counters["deflected"] > tracer.report.counters["samples"] > 1000
    )
    # jumps of extinction turn rounded places into some 1e-6
    assert np.abs(bent.rgba - straight.rgba).max() < 2e-5
    assert bent.depth_mm is not None
    assert straight.depth_mm is not None
    seen = np.isfinite(straight.depth_mm)
    assert np.array_equal(np.isfinite(bent.depth_mm), seen)
    # to one step, where opacity passes a half at its very end
    off = np.abs(bent.depth_mm[seen] - straight.depth_mm[seen])
    assert off.max() < 0.3
    assert np.mean(off > 1e-3) < 0.01


@pytest.mark.parametrize(
    "name", [pytest.param("swollen", marks=pytest.mark.slow), "cut"]
)
def test_halving_the_step_quarters_the_error(scene: Scene, name: str) -> None:
    """Extinction that jumps, lights: of second order, where post has the first.

    At half a voxel .35 to .45 times as much is left as by post, at an eighth .2 times.
    """
    center = scene.volume.center_mm + 4 * TOWARD / np.linalg.norm(TOWARD)
    one = {"swollen": Scaling(center, 8.0, 1.7), "cut": Cut(center, 8.0, AXIS, 2.0)}
    deflection, camera = Deflection((one[name],)), view(scene)
    truth = found_by(scene, 1 / 64, "integrated", deflection, camera)
    wanted = render_reference(
        scene, camera, float(scene.volume.spacing_mm.min()) / 32, deflection=deflection
    )
    # what the reference leaves, whose samples are classified one by one
    assert image_error(truth, wanted).rmse < 2e-4
    errors = {
        kind: [
            image_error(found_by(scene, step, kind, deflection, camera), truth).rmse
            for step in (1.0, 0.5, 0.25, 0.125)
        ]
        for kind in ("post", "integrated")
    }
    order = {kind: math.log2(e[1] / e[3]) / 2 for kind, e in errors.items()}
    assert order["integrated"] == pytest.approx(2, abs=0.3)
    assert order["post"] == pytest.approx(1.1, abs=0.3)
    assert errors["integrated"][3] < 0.35 * errors["post"][3]


def test_a_shell_thinner_than_a_step_is_seen_whole_through_a_bend() -> None:
    """A film of 20 HU where a voxel has 50, in tissue that swells by a half."""
    spike = TransferFunction(
        np.array([-10.0, 0, 10]), np.ones((3, 3)), np.array([0, 8.0, 0])
    )
    volume = hounsfield(distances(8.0, 0.25), 0.25)
    scene = Scene(volume, spike, (), PhongMaterial(1, 0, 0))
    camera = Camera.looking_at(
        [0.0, -24.0, 0.0], [0.0, 0, 0], extent=0.2, size=(48, 48),
        projection=Projection.PERSPECTIVE,
    )  # fmt: skip
    swollen = Deflection((Scaling(np.array([0.0, -8.0, 0.0]), 5.0, 1.5),))
    # post-classified: six samples in the film, and more where it is seen aslant
    truth = found_by(scene, 1 / 16, "post", swollen, camera)
    still = found_by(scene, 1 / 16, "post", None, camera)
    assert image_error(still, truth).rmse > 0.02
    error = {
        kind: image_error(found_by(scene, 1.0, kind, swollen, camera), truth).rmse
        for kind in ("post", "integrated")
    }
    assert error["integrated"] < 0.012
    assert error["post"] > 20 * error["integrated"]
