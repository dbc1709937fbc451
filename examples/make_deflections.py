"""Make ``docs/pictures/deflections.png``: a turbinate deformed, by rays and by splats.

    python examples/make_deflections.py

Columns: as it is, pulled aside, turned, swollen, shrunk, cut. Above what bent rays see,
below displaced splats.
"""

import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from anatomy import classic_transfer_function, sinus_phantom
from renderers.art import ActiveRayTracer
from renderers.fsr import FuzzySetRenderer
from renderers.scene import (
    AirSurface,
    Camera,
    GBuffer,
    Scene,
    rmse_codes,
    save_png,
    ssim,
)
from renderers.scene.deflection import (
    Cut,
    Deflection,
    Rotation,
    Scaling,
    Translation,
    deflected_scene,
)
from renderers.shading import CameraPass, ScopeLight, ScopeShader, Tier, scope_picture

SIZE = 256

# the head of the middle turbinate, right, seen from in front
PLACE = np.array([-5.9, 14.3, 24.0])
OUT = np.array([0.09, -0.707, -0.702])
EYE = np.array([-5.235, 8.632, 19.059])
RIGHT = np.array([1.0, 0.0, 0.0])
DEEP = PLACE - 2 * OUT

KINDS = {
    "as it is": Deflection(),
    "pulled aside": Deflection((Translation(DEEP, 7.0, 3.0 * RIGHT),)),
    "turned": Deflection((Rotation(PLACE, 8.0, OUT, -1.0),)),
    "swollen": Deflection((Scaling(DEEP, 7.0, 1.8),)),
    "shrunk": Deflection((Scaling(DEEP, 7.0, 0.6),)),
    "cut": Deflection((Cut(PLACE - OUT, 5.0, RIGHT, 1.2),)),
}


def main() -> None:
    """Deform, draw both ways, compare and save."""
    phantom = sinus_phantom()
    surface = AirSurface(phantom.distance, phantom.blood, phantom.skin)
    scene = Scene(phantom.ct, classic_transfer_function(), surface=surface)
    camera = Camera.looking_at(EYE, PLACE, extent=math.radians(40.0), size=(SIZE, SIZE))
    columns = []
    for name, deflection in KINDS.items():
        deformed = deflected_scene(scene, deflection)
        # light and tint of both are those of the deformed tissue
        bent = ActiveRayTracer(scene, deflection=deflection).gbuffer(camera)
        rays, gain = finished(deformed, bent, camera, None)
        splatter = FuzzySetRenderer(scene, deflection=deflection)
        splats, _ = finished(deformed, splatter.gbuffer(camera), camera, gain)
        splatter.close()
        alike = f"SSIM {ssim(splats, rays):.3f}, {rmse_codes(splats, rays):.1f} codes"
        print(f"{name:14s} {alike}")
        columns.append(np.vstack([rays, splats]))
    target = Path(__file__).parents[1] / "docs" / "pictures" / "deflections.png"
    save_png(target, np.hstack(columns))
    print(target)


def finished(
    scene: Scene, buffer: GBuffer, camera: Camera, gain: float | None
) -> tuple[NDArray[np.uint8], float]:
    """Light a buffer and take the picture."""
    assert scene.surface is not None
    shader = ScopeShader(scene.surface, Tier.LIVE)
    return scope_picture(buffer, camera, shader, CameraPass(), ScopeLight(), gain)


if __name__ == "__main__":
    main()
