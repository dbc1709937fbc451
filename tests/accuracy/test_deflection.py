"""Splats moved by deflectors look as the ray caster's deformed tissue does."""

import numpy as np
import pytest
from numpy.typing import NDArray

from anatomy import (
    Phantom,
    PhantomParameters,
    build_phantom,
    classic_transfer_function,
)
from renderers.art import ActiveRayTracer
from renderers.fsr import FuzzySetRenderer
from renderers.scene import AirSurface, Camera, GBuffer, Scene, rmse_codes, ssim
from renderers.scene.deflection import (
    Cut,
    Deflection,
    Rotation,
    Scaling,
    Translation,
    deflected_scene,
)
from renderers.shading import CameraPass, ScopeLight, ScopeShader, Tier, scope_picture

SPACING_MM = 0.7
SIZE = 256

# head of the middle turbinate and the way out of it, seen from in front
PLACE = np.array([-5.9, 14.3, 24.0])
OUT = np.array([0.09, -0.707, -0.702])
EYE = np.array([-5.235, 8.632, 19.059])
RIGHT = np.array([1.0, 0.0, 0.0])
DEEP = PLACE - 2 * OUT

KINDS = {
    "pulled aside": (Translation(DEEP, 7.0, 3.0 * RIGHT),),
    "turned": (Rotation(PLACE, 8.0, OUT, -1.0),),
    "swollen": (Scaling(DEEP, 7.0, 1.8),),
    "shrunk": (Scaling(DEEP, 7.0, 0.6),),
    "swollen, then pulled": (
        Scaling(DEEP, 7.0, 1.5),
        Translation(DEEP, 7.0, -2.0 * RIGHT),
    ),
    "cut": (Cut(PLACE - OUT, 5.0, RIGHT, 1.2),),
}


@pytest.fixture(scope="module")
def phantom() -> Phantom:
    box = ((-32.0, 12.0), (-6.0, 60.0), (-4.0, 56.0))
    return build_phantom(PhantomParameters(), SPACING_MM, field_mm=box)


def camera() -> Camera:
    return Camera.looking_at(EYE, PLACE, extent=np.radians(40.0), size=(SIZE, SIZE))


def shown(
    scene: Scene, buffer: GBuffer, gain: float | None
) -> tuple[NDArray[np.uint8], float]:
    assert scene.surface is not None
    shader = ScopeShader(scene.surface, Tier.LIVE, threads=2)
    return scope_picture(
        buffer, camera(), shader, CameraPass(threads=2), ScopeLight(), gain
    )


@pytest.mark.slow
@pytest.mark.parametrize("name", list(KINDS))
def test_deformed_tissue_looks_the_same_by_splats_and_by_rays(
    phantom: Phantom, name: str
) -> None:
    surface = AirSurface(phantom.distance, phantom.blood, phantom.skin)
    scene = Scene(phantom.ct, classic_transfer_function(), surface=surface)
    deflection = Deflection(KINDS[name])
    deformed = deflected_scene(scene, deflection)
    splats = FuzzySetRenderer(scene, deflection=deflection)
    found = splats.gbuffer(camera())
    met = ActiveRayTracer(deformed).gbuffer(camera())
    wanted, gain = shown(deformed, met, None)
    picture, _ = shown(deformed, found, gain)
    still, _ = shown(scene, ActiveRayTracer(scene).gbuffer(camera()), gain)
    splats.close()
    assert rmse_codes(still, wanted) > 11, "it moves"
    assert ssim(picture, wanted) >= 0.95
    assert rmse_codes(picture, wanted) <= 11.0
    assert np.all(found.coverage[met.coverage > 0] == 1), "no hole pixels"
