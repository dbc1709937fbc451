"""Make ``docs/pictures/classic.png``: mode `classic` of the fuzzy-set renderer.

    python examples/make_classic_pictures.py

Bone from the front and the nasal passage from the nasopharynx, each as points and
as single splats, under the four infinite lights of 1995.
"""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from anatomy import bone_transfer_function, classic_transfer_function, sinus_phantom
from renderers.fsr import FuzzySetRenderer, SplatMode
from renderers.scene import Camera, Projection, Scene, srgb_from_linear

SIDE = 400
SPACING_MM = 0.5


def main() -> None:
    """Draw both views in all modes, label and save."""
    phantom = sinus_phantom(spacing_mm=SPACING_MM)
    tissue = Scene(phantom.ct, classic_transfer_function())
    bone = replace(tissue, transfer_function=bone_transfer_function())
    place = {name: mark.position_mm for name, mark in phantom.landmarks.items()}
    centre = phantom.ct.center_mm
    front = Camera.looking_at(
        centre + np.array([90.0, -260.0, 40.0]),
        centre,
        extent=math.radians(13),
        size=(SIDE, SIDE),
        projection=Projection.PERSPECTIVE,
    )
    passage = Camera.looking_at(
        place["nasopharynx"],
        place["inferior turbinate head, left"],
        extent=math.radians(40),
        size=(SIDE, SIDE),
        projection=Projection.PERSPECTIVE,
    )
    rows = [in_all_modes(bone, front), in_all_modes(tissue, passage)]
    target = Path(__file__).parents[1] / "docs" / "pictures" / "classic.png"
    Image.fromarray(np.vstack(rows)).save(target, optimize=True)
    print(target)


def in_all_modes(scene: Scene, camera: Camera) -> NDArray[np.uint8]:
    """Give one view drawn both ways side by side, with their names."""
    renderer = FuzzySetRenderer(scene)
    panels = []
    for mode in SplatMode:
        renderer.mode = mode
        linear = renderer.render(camera).rgba[..., :3]
        picture = Image.fromarray(np.rint(srgb_from_linear(linear) * 255).astype("u1"))
        label = f"{mode.value}, {renderer.counters['splats']} splats"
        ImageDraw.Draw(picture).text((6, 4), label, fill=(255, 255, 255))
        panels.append(np.asarray(picture))
    renderer.close()
    return np.hstack(panels)


if __name__ == "__main__":
    main()
