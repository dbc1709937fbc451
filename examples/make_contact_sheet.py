"""Make ``docs/pictures/anatomy_seeds.png``: coronal CT slices of twelve patients.

    python examples/make_contact_sheet.py

Each patient is drawn from a seed; three slices each, from the frontal recess over the
ostiomeatal complex to the sphenoid sinuses. The patient's right is on the left, as in
radiology; the window is the one used for sinuses, 2000 HU wide about 300.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from anatomy import Phantom, build_phantom, draw_parameters

SEEDS = range(12)
COLUMNS = 3
SPACING_MM = 0.5
FIELD_MM = ((-52.0, 52.0), (2.0, 70.0), (-14.0, 80.0))
SLICES_MM = (12.0, 28.0, 62.0)
LOW_HU, HIGH_HU = -700.0, 1300.0


def main() -> None:
    """Build the heads, cut, label and save."""
    cells = [labelled(seed) for seed in SEEDS]
    rows = [np.hstack(cells[i : i + COLUMNS]) for i in range(0, len(cells), COLUMNS)]
    target = Path(__file__).parents[1] / "docs" / "pictures" / "anatomy_seeds.png"
    Image.fromarray(np.vstack(rows)).save(target, optimize=True)
    print(target)


def labelled(seed: int) -> NDArray[np.uint8]:
    """Give one patient's slices side by side with the seed and the variants."""
    parameters = draw_parameters(seed)
    phantom = build_phantom(parameters, SPACING_MM, field_mm=FIELD_MM)
    cell = np.hstack([coronal(phantom, at) for at in SLICES_MM])
    picture = Image.fromarray(np.pad(cell, ((22, 6), (3, 3))))
    words = [v.replace(":left", " L").replace(":right", " R")
             for v in parameters.variants if not v.startswith("agger")]  # fmt: skip
    line = ", ".join([f"{seed}: keros {parameters.keros_mm:.1f}", *words])
    draw = ImageDraw.Draw(picture)
    if draw.textlength(line) > picture.width - 12:
        raise ValueError(f"the caption is wider than the slices: {line}")
    draw.text((6, 5), line, fill=230)
    return np.asarray(picture)


def coronal(phantom: Phantom, y_mm: float) -> NDArray[np.uint8]:
    """Cut at an LPS depth, superior up, scaled to grey levels."""
    volume = phantom.ct
    at = y_mm * phantom.parameters.head_scale
    index = round((at - float(volume.origin_mm[1])) / float(volume.spacing_mm[1]))
    hu = volume.values[::-1, index, :].astype(float)
    grey = np.clip((hu - LOW_HU) / (HIGH_HU - LOW_HU), 0, 1)
    return (255 * grey).astype(np.uint8)


if __name__ == "__main__":
    main()
