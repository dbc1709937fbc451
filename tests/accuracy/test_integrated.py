"""Pictures by integrated transfer functions, at the tolerances of quality `final`.

Balls and shells with a jump at their surface (S2, S3 of `test_ray_caster.py`, which has
the scenes that one ray can tell), a shell thinner than a step, and a phantom's head.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from anatomy import bone_transfer_function, classic_transfer_function, sinus_phantom
from renderers.art import ActiveRayTracer, Quality
from renderers.art.quality import ClassificationName
from renderers.reference import render_reference
from renderers.scene import (
    Camera,
    PhongMaterial,
    Projection,
    Scene,
    TransferFunction,
    Volume,
    four_lights,
    image_error,
    srgb_from_linear,
    ssim,
)
from tests.accuracy.balls import distances, hounsfield

FINAL = Quality.named("final")
KAPPA = 0.1
SIZE = 128


def jump_scene(distance_mm: NDArray[np.float64], h: float) -> Scene:
    """Keep 200 HU a millimetre, whole, to 1000; extinction jumps at 0 HU."""
    transfer = TransferFunction(
        np.array([-1e-3, 0.0]), np.ones((2, 3)), np.array([0, KAPPA])
    )
    return Scene(hounsfield(distance_mm, h), transfer, (), PhongMaterial(1, 0, 0))


def from_outside() -> tuple[Camera, NDArray[np.float64]]:
    """Look from 24 mm; give how far from the middle rays pass."""
    camera = Camera.looking_at(
        [0.0, -24.0, 0.0], [0.0, 0, 0], extent=0.45, size=(SIZE, SIZE),
        projection=Projection.PERSPECTIVE,
    )  # fmt: skip
    origins, ways = camera.rays()
    return camera, np.linalg.norm(np.cross(origins, ways), axis=-1)


def chord(radius_mm: float, passing: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(2 * np.sqrt(np.maximum(radius_mm**2 - passing**2, 0)))


@pytest.mark.parametrize(
    ("shell", "h", "step", "rmse", "most"),
    [
        (False, 0.25, 0.25, 7e-4, 1.5e-3),
        (True, 0.25, 0.25, 7e-4, 1.5e-3),
        (False, 0.25, 1.0, 7e-4, 1.5e-3),
        (False, 0.125, 0.25, 1.5e-4, 1.5e-3),
    ],
)
def test_balls_and_shells_off_their_silhouettes(
    shell: bool, h: float, step: float, rmse: float, most: float
) -> None:
    """The table has the user's own nodes: no bias is left of where the jump lies."""
    distance = distances(8.0, h)
    camera, passing = from_outside()
    way = chord(8.0, passing)
    clear = np.abs(passing - 8) > 1.5 * h
    if shell:
        distance = np.minimum(distance, -distances(6.0, h))
        way -= chord(6.0, passing)
        clear &= np.abs(passing - 6) > 1.5 * h
    quality = replace(FINAL, step_voxels=step)
    found = ActiveRayTracer(jump_scene(distance, h), quality).render(camera)
    error = (found.rgba[..., 3] + np.expm1(-KAPPA * way))[clear]
    assert np.sqrt(np.mean(error**2)) < rmse
    assert np.abs(error).max() < most


def test_halving_the_step_quarters_what_a_jump_leaves() -> None:
    """Second order, where post-classified steps have the first."""
    scene = jump_scene(distances(8.0, 0.5), 0.5)
    camera, passing = from_outside()
    clear = np.abs(passing - 8) > 0.75
    finest = Quality(1 / 32, 0.0, classification="integrated")
    truth = ActiveRayTracer(scene, finest).render(camera).rgba[clear]
    errors = {
        name: [
            image_error(
                ActiveRayTracer(scene, Quality(step, 0.0, classification=name))
                .render(camera)
                .rgba[clear],
                truth,
            ).rmse
            for step in (2.0, 1.0, 0.5)
        ]
        for name in ("post", "integrated")
    }
    orders = {name: math.log2(e[0] / e[-1]) / 2 for name, e in errors.items()}
    assert orders["integrated"] == pytest.approx(2, abs=0.3)
    assert orders["post"] == pytest.approx(1, abs=0.3)
    assert errors["integrated"][0] < errors["post"][-1]


def test_a_shell_thinner_than_a_step_is_seen_whole() -> None:
    """A spike of 20 HU where a voxel has 50: post-classified, it is full of holes."""
    volume = jump_scene(distances(8.0, 0.25), 0.25).volume
    spike = TransferFunction(
        np.array([-10.0, 0, 10]), np.ones((3, 3)), np.array([0, 8.0, 0])
    )
    scene = Scene(volume, spike, (), PhongMaterial(1, 0, 0))
    camera, passing = from_outside()
    inner = passing < 6
    # through both walls, each 20 HU of 200 a millimetre, seen aslant
    slope = 200 * np.sqrt(1 - (passing[inner] / 8) ** 2)
    exact = -np.expm1(-2 * 8.0 * 10 / slope)
    error = {}
    for name in ("post", "integrated"):
        quality = Quality(1.0, 0.0, classification=name)
        found = ActiveRayTracer(scene, quality).render(camera).rgba[..., 3]
        error[name] = float(np.sqrt(np.mean((found[inner] - exact) ** 2)))
    assert error["integrated"] < 0.01
    assert error["post"] > 20 * error["integrated"]


FILM = TransferFunction(
    np.array([-510.0, -480, -450]),
    np.array([[0.55, 0.2, 0.18], [0.9, 0.6, 0.5], [0.55, 0.2, 0.18]]),
    np.array([0.0, 8, 0]),
)
"""Where tissue begins: a voxel at a wall passes some hundred HU."""

HEAD_BOUNDS = {
    # RMSE and SSIM
    "preview": (4e-3, 0.999),
    "snapshot": (1.5e-3, 0.9995),
    "final": (5e-4, 0.9999),
}


@pytest.mark.slow
@pytest.mark.parametrize("look", ["lit", "unlit", "see-through", "thin shell"])
def test_a_head_is_within_the_tolerances_of_each_quality(look: str) -> None:
    """Against a thirty-second of a voxel, from within the nose and from outside.

    Post-classified, steps as long as the quality's own leave more than that. Where
    bone is seen through tissue, integrated steps as long leave more, too: they are
    shortened for that scene; most where a film of 60 HU is seen, a tenth of a voxel.
    """
    phantom = sinus_phantom(spacing_mm=1.0)
    transfer = classic_transfer_function()
    if look == "see-through":
        transfer = bone_transfer_function()
    elif look == "thin shell":
        transfer = FILM
    scene = Scene(phantom.ct, transfer, four_lights())
    if look != "lit":
        scene = replace(scene, lights=(), material=PhongMaterial(1, 0, 0))
    place = {name: mark.position_mm for name, mark in phantom.landmarks.items()}
    size_mm = np.linalg.norm(phantom.ct.spacing_mm * phantom.ct.shape[::-1])
    center = phantom.ct.center_mm
    within = place["nasal valve, left"], place["middle meatus, left"], 0.768
    before = center + 1.43 * size_mm * np.array([0.06, -1.0, 0.04]), center, 0.349
    for eye, target, extent in (within, before):
        camera = Camera.looking_at(
            eye, target, extent=extent, size=(192, 192),
            projection=Projection.PERSPECTIVE,
        )  # fmt: skip
        # no scene's own step is as short
        step = 1 / 128 if look == "thin shell" else 1 / 32
        finest = Quality(step, 1e-6, classification="integrated")
        truth = ActiveRayTracer(scene, finest).render(camera).rgba
        for name, (rmse, likeness) in HEAD_BOUNDS.items():
            tracer = ActiveRayTracer(scene, name)
            found = tracer.render(camera).rgba
            error = image_error(found, truth)
            assert error.rmse < rmse, name
            assert error.p999 < 8 * rmse, name
            # not rounded to codes, which alone would cost 3e-4 to 1.1e-3
            codes = [255 * srgb_from_linear(p[..., :3]) for p in (found, truth)]
            assert ssim(*codes) > likeness, name
            shortened = look in ("see-through", "thin shell")
            worse: ClassificationName = "integrated" if shortened else "post"
            # .0004 of .0005: in a closed head a quarter of a voxel will do for bone
            will_do = name == "final" and look == "see-through"
            if name == "preview" or (shortened and not will_do):
                coarse = replace(tracer.quality, classification=worse, tolerance=None)
                found = ActiveRayTracer(scene, coarse).render(camera).rgba
                assert image_error(found, truth).rmse > rmse


def test_fine_steps_find_what_gauss_steps_find() -> None:
    """Noise, a spike and a jump; another method, in float64, from kink to kink."""
    values = np.random.default_rng(6).uniform(-100, 100, (6, 7, 5)).astype(np.float32)
    volume = Volume(values, np.array([1.0, 0.8, 1.3]), np.array([-2.0, -3, -2]))
    nodes = np.array([-40.0, -5, 0, 5, 30, 30.001, 90])
    transfer = TransferFunction(
        nodes,
        np.random.default_rng(7).random((7, 3)),
        np.array([0, 0, 3, 0.1, 0.1, 1, 2]),
    )
    scene = Scene(volume, transfer, (), PhongMaterial(1, 0, 0))
    camera = Camera.looking_at(
        [-7.0, -9, 4], [0.3, -0.4, 0.2], extent=0.2, size=(8, 8),
        projection=Projection.PERSPECTIVE,
    )  # fmt: skip
    truth = render_reference(scene, camera, 1 / 64, shaded=False, rule="gauss")
    errors = [
        image_error(
            ActiveRayTracer(scene, Quality(step, 0.0, classification="integrated"))
            .render(camera)
            .rgba,
            truth,
        ).max
        for step in (1 / 8, 1 / 32, 1 / 128)
    ]
    assert errors[-1] < 1e-4
    assert math.log2(errors[0] / errors[-1]) / 4 > 1.5
