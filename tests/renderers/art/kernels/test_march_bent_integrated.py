"""Bent rays that integrate: as straight ones where nothing bends, of second order."""

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from renderers.art import ActiveRayTracer, Quality
from renderers.art.quality import ClassificationName
from renderers.reference import render_reference
from renderers.scene import (
    Camera,
    PhongMaterial,
    Projection,
    Scene,
    TransferFunction,
    image_error,
)
from renderers.scene.deflection import Cut, Deflection, Scaling, Translation
from tests.accuracy.balls import distances, hounsfield

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
    assert tracer.report.counters["bent"] > tracer.report.counters["samples"] > 1000
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
