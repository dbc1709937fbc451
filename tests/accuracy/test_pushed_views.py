"""Pushed tissue with cuts and blood on it: splats show it as rays do, with its look."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from renderers.art import ActiveRayTracer
from renderers.fsr import FuzzySetRenderer
from renderers.scene import Camera, ssim
from renderers.shading import CameraPass, ScopeLight, ScopeShader, scope_picture
from surgery.patient import OperatedPatient
from surgery.pushing import Pushing, ToolCapsule
from tests.accuracy.wounded_views import VIEWS, WoundedView, scene_of, wounded

SIZE = 320
LEAST_SSIM = 0.97
"""As of wounds that nobody pushes; measured .983 to .986."""

PLACE = np.array([-6.16, 16.65, 22.12])
"""On the head of the middle turbinate, below its wounds."""

_ASIDE = np.array([-0.56, 0.77, -0.31])


def bloody(view: WoundedView) -> OperatedPatient:
    """Return the head with the cuts of a view, and blood beside them."""
    patient = wounded(view)
    distance = patient.surface.distance
    k, j, i = np.indices(distance.shape, sparse=True)
    middle = np.array([-7.68, 14.61, 24.42])
    at = distance.voxel_from_world[:3, :3] @ middle + distance.voxel_from_world[:3, 3]
    away2 = (i - at[0]) ** 2 + (j - at[1]) ** 2 + (k - at[2]) ** 2
    thick = 30 * np.clip(1 - away2 * (distance.spacing_mm[0] / 1.6) ** 2, 0, 1)
    patient.wounds_film[:] = np.rint(thick).astype(np.uint8)
    return patient


def dented(pushing: Pushing, eye: np.ndarray) -> None:
    """Press a tool of 1 mm into the head of the turbinate, from the eye."""
    back = (eye - PLACE) / np.linalg.norm(eye - PLACE)
    for n, depth in enumerate(np.linspace(0, 1.2, 8)):
        tip = PLACE + back * (1.0 - depth)
        pushing.push(0.05 * n, n, ToolCapsule.of(tip, back, 1.0))


def carried(pushing: Pushing, eye: np.ndarray) -> None:
    """Push the turbinate aside, by more than 3 mm, and let go."""
    aside = _ASIDE / np.linalg.norm(_ASIDE)
    back = 0.7 * (eye - PLACE) / np.linalg.norm(eye - PLACE) - 0.3 * aside
    for n, depth in enumerate(np.linspace(0, 3.5, 20)):
        pushing.push(
            0.05 * n, n, ToolCapsule.of(PLACE + aside * (depth - 1.0), back, 1.0)
        )
    pushing.push(5.0, 50, None)
    pushing.push(15.0, 51, None)
    assert np.linalg.norm(pushing.shifts[:, 3:6], axis=1).max() > 3.0


@pytest.mark.slow
@pytest.mark.parametrize("push", [dented, carried])
def test_splats_show_pushed_tissue_as_rays_do(
    push: Callable[[Pushing, np.ndarray], None],
) -> None:
    view = VIEWS[1]
    pushing = Pushing(bloody(view))
    camera: Camera = view.camera(SIZE)
    push(pushing, np.array(view.eye))
    surface = pushing.surface
    scene = replace(scene_of(wounded(view)), surface=surface)
    shader, camera_pass = ScopeShader(surface), CameraPass()
    light = ScopeLight(0.95)
    traced = ActiveRayTracer(scene, threads=1).gbuffer(camera)
    splatted = FuzzySetRenderer(scene, threads=1).gbuffer(camera)
    truth, gain = scope_picture(traced, camera, shader, camera_pass, light, None)
    found, _ = scope_picture(splatted, camera, shader, camera_pass, light, gain)
    assert not np.any((traced.coverage > 0) & (splatted.coverage == 0))
    assert ssim(found, truth) >= LEAST_SSIM
    # with its look left behind it would be another picture
    slid = ScopeShader(replace(surface, rest=None))
    left, _ = scope_picture(traced, camera, slid, camera_pass, light, gain)
    assert ssim(left, truth) < 0.95
