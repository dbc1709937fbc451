"""Show a virtual patient and an instrument in pyvista, without a screen.

    python examples/show_head_in_pyvista.py

``out/head.png``: a steel tube on its way into the right nostril, splats around it.
"""

from pathlib import Path
from typing import Any

import numpy as np
import pyvista as pv
import trimesh

from anatomy import classic_transfer_function, sinus_phantom
from renderers.fsr import SplatActor, extract_fuzzy_set
from renderers.scene import Scene


def main(target: Path, spacing_mm: float = 0.5, side: int = 768) -> None:
    """Draw and save; spacing_mm: of the patient's voxels, side: of the picture, px."""
    phantom = sinus_phantom(spacing_mm=spacing_mm)
    scene = Scene(phantom.ct, classic_transfer_function())
    head = SplatActor(extract_fuzzy_set(scene), scene)
    nostril = phantom.landmarks["nostril, right"].position_mm
    outward = np.array([-0.15, -0.45, -0.88])
    line = np.stack([nostril - 10 * outward, nostril + 60 * outward])
    tube = trimesh.creation.annulus(r_min=0.8, r_max=1.2, segment=line)

    plotter: Any = pv.Plotter(off_screen=True, window_size=[side, side])
    plotter.set_background("black")
    plotter.add_mesh(pv.wrap(tube), color="silver", specular=0.6)
    place = phantom.ct.center_mm + np.array([-110.0, -310.0, -150.0])
    plotter.camera_position = [place, phantom.ct.center_mm, (0, 0, 1)]
    head.show_in(plotter.renderer)  # in place of add_actor: it keeps splats in order
    plotter.reset_camera_clipping_range()
    target.parent.mkdir(parents=True, exist_ok=True)
    plotter.screenshot(target)
    plotter.close()


if __name__ == "__main__":
    main(Path("out/head.png"))
