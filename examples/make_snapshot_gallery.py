"""Make ``docs/pictures/snapshots.png``: what ``paravol snapshot`` writes, of one view.

    python examples/make_snapshot_gallery.py

Every panel is made by the command, from a view file, as anybody would make it.
"""

import json
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from app.__main__ import main as paravol
from renderers.scene import save_png

SIZE = 256
BAND_PX = 26

# the middle turbinate, right, from in front
EYE = [-5.235, 8.632, 19.059]
TARGET = [-5.9, 14.3, 24.0]
VIEW: dict[str, Any] = {
    "schema": "paravol.view/1",
    "head": {"kind": "phantom", "seed": 1},
    "camera": {"eye_mm": EYE, "target_mm": TARGET, "extent": 0.7},
    "size_px": [SIZE, SIZE],
}
SWOLLEN = {"kind": "scale", "center_mm": [-6.1, 15.7, 25.4], "radius_mm": 7.0}
CUT = {"kind": "cut", "center_mm": [-6.0, 15.0, 24.7], "radius_mm": 5.0}
CHANGES: dict[str, dict[str, Any]] = {
    "swollen: bent rays": {"deflectors": [SWOLLEN | {"factor": 1.8}]},
    "cut: bent rays": {
        "deflectors": [CUT | {"normal": [1.0, 0.0, 0.0], "pull_mm": 1.2}]
    },
    # from just beside the septum: what lies before the eye is cut away
    "orthographic: the side wall": {
        "camera": {
            "eye_mm": [-2.0, 25.0, 22.0],
            "target_mm": [-30.0, 25.0, 22.0],
            "extent": 31.0,
            "projection": "orthographic",
        },
        "look": {"mode": "classic"},
    },
}


def main() -> None:
    """Take the pictures and put them on one sheet."""
    with tempfile.TemporaryDirectory() as name:
        panels = taken(Path(name))
    columns = 4
    rows = -(-len(panels) // columns)
    sheet = Image.new("RGB", (columns * SIZE, rows * (SIZE + BAND_PX)))
    draw = ImageDraw.Draw(sheet)
    font = ImageFont.load_default(size=14)
    for number, (caption, pixels) in enumerate(panels.items()):
        x, y = number % columns * SIZE, number // columns * (SIZE + BAND_PX)
        draw.text((x + 8, y + 5), caption, fill=(230, 230, 230), font=font)
        sheet.paste(Image.fromarray(pixels), (x, y + BAND_PX))
    out = Path(__file__).parents[1] / "docs" / "pictures" / "snapshots.png"
    save_png(out, np.asarray(sheet))


def taken(folder: Path) -> dict[str, NDArray[np.uint8]]:
    """Run the command; give the panels by their captions."""
    first, doubt = folder / "a.png", folder / "doubt.png"
    shoot(VIEW, first, "--against", "fsr", "--confidence", str(doubt))
    panels = {
        "snapshot": pixels_of(first),
        "--against fsr: difference": right_of(folder / "a-error.png")[-SIZE:],
        "--confidence": right_of(doubt),
    }
    traced = folder / "path-traced.png"
    shoot(VIEW, traced, "--path-traced", "--path-samples", "64", "--samples", "1")
    panels["--path-traced, 64 paths"] = pixels_of(traced)
    for caption, change in CHANGES.items():
        file = folder / f"{len(panels)}.png"
        shoot(VIEW | change, file)
        panels[caption] = pixels_of(file)
    early = folder / "early.png"
    shoot(
        VIEW | {"look": {"mode": "classic"}}, early, "--quality", "reference",
        "--time-limit", "1.5",
    )  # fmt: skip
    panels["stopped after 1.5 s"] = pixels_of(early)
    if not panels["stopped after 1.5 s"].any():
        raise SystemExit("no ray was traced in 1.5 s; run this on a quieter machine")
    return panels


def shoot(view: dict[str, Any], out: Path, *words: str) -> None:
    """Write a view file and take its picture."""
    if view.get("look") == {"mode": "classic"} and "projection" not in view["camera"]:
        view = view | {"camera": view["camera"] | {"projection": "perspective"}}
    file = out.with_suffix(".view.json")
    file.write_text(json.dumps(view))
    words = ("--view", str(file), "--out", str(out), *words)
    if paravol(["snapshot", *words]) != 0:
        raise SystemExit(f"paravol snapshot {' '.join(words)} failed")


def pixels_of(file: Path) -> NDArray[np.uint8]:
    """Read a picture."""
    with Image.open(file) as image:
        return np.asarray(image.convert("RGB"))


def right_of(file: Path) -> NDArray[np.uint8]:
    """Read the rightmost square of a picture."""
    return pixels_of(file)[:, -SIZE:]


if __name__ == "__main__":
    main()
