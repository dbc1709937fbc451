"""Make ``docs/pictures/deflections.png``: a turbinate deformed, by rays and by splats.

    python examples/make_deflections.py

Columns: as it is, pulled aside, turned, swollen, shrunk, cut. Above what bent rays see,
below displaced splats.
"""

from pathlib import Path

import numpy as np

from anatomy import sinus_phantom
from benchmarks.deflected_turbinate import (
    DEFORMATIONS,
    turbinate_camera,
    turbinate_picture,
    turbinate_scene,
)
from renderers.art import ActiveRayTracer
from renderers.fsr import FuzzySetRenderer
from renderers.scene import rmse_codes, save_png, ssim
from renderers.scene.deflection import Deflection, deflected_scene

COLUMNS = ("as it is", "pulled aside", "turned", "swollen", "shrunk", "cut")


def main() -> None:
    """Deform, draw both ways, compare and save."""
    scene, camera = turbinate_scene(sinus_phantom()), turbinate_camera()
    columns = []
    for name in COLUMNS:
        deflection = DEFORMATIONS.get(name, Deflection())
        deformed = deflected_scene(scene, deflection)
        # light and tint of both are those of the deformed tissue
        bent = ActiveRayTracer(scene, deflection=deflection).gbuffer(camera)
        rays, gain = turbinate_picture(deformed, bent, None)
        splatter = FuzzySetRenderer(scene, deflection=deflection)
        splats, _ = turbinate_picture(deformed, splatter.gbuffer(camera), gain)
        splatter.close()
        alike = f"SSIM {ssim(splats, rays):.3f}, {rmse_codes(splats, rays):.1f} codes"
        print(f"{name:14s} {alike}")
        columns.append(np.vstack([rays, splats]))
    target = Path(__file__).parents[1] / "docs" / "pictures" / "deflections.png"
    save_png(target, np.hstack(columns))
    print(target)


if __name__ == "__main__":
    main()
