"""The confidence map of a picture: where it may hide thin bone."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from paravol.snapshots.head_scene import HeadScene
from paravol.snapshots.outputs import RenderedPicture
from paravol.snapshots.picture_files import save_depth_nrrd
from renderers.scene import AirSurface, save_png
from renderers.scene.deflection import deflected_distance
from renderers.snapshots.request import to_deflection
from system import UserError

TINT = np.array([255.0, 40.0, 200.0])
"""Where a wall may be hidden: no tissue is magenta."""


@dataclass(frozen=True, slots=True)
class WallConfidence:
    """Report how much of a picture is sure.

    sure: share of the pixels in the field. resolved_mm: walls at least so thick are
    never lost. file: the map.
    """

    sure: float
    resolved_mm: float
    file: str


def require_map(file: Path) -> None:
    """Raise UserError for an ending that no map is written to."""
    if file.suffix.lower() not in (".png", ".nrrd"):
        raise UserError(f"--confidence goes to a .png or .nrrd, got {file}.")


def rated_surface(head: HeadScene) -> AirSurface:
    """Return the surface that is rated; UserError where a head has none."""
    surface = head.scene.surface
    if surface is None:
        raise UserError(
            "A scan has no surface whose walls could be measured; make a case of it "
            "with paravol import."
        )
    return surface


def save_wall_confidence(
    head: HeadScene, picture: RenderedPicture, file: Path, threads: int
) -> WallConfidence:
    """Rate each pixel (see `renderers.art.confidence`); write the map.

    PNG: the picture, and beside it a paled one with doubtful pixels in magenta.
    NRRD: the rating, 0 to 1.
    """
    from renderers.art.wall_confidence import wall_confidence

    surface = head.seen(picture.view).surface or rated_surface(head)
    camera = picture.view.to_camera()
    distance = deflected_distance(
        surface.distance, to_deflection(picture.view.deflectors)
    )
    rating = wall_confidence(distance, camera, picture.depth_mm, threads=threads)
    text = picture.text() | {"Confidence": "1 is sure, 0 least sure"}
    if file.suffix.lower() == ".nrrd":
        save_depth_nrrd(file, rating, text)
    else:
        save_png(
            file, np.hstack([picture.pixels, tinted(picture.pixels, rating)]), text
        )
    rays = camera.lens_table()
    seen = np.linalg.norm(rays, axis=-1) > 0.5
    sure = float((rating[seen] == 1).mean())
    return WallConfidence(sure, float(surface.distance.spacing_mm.max()), str(file))


def tinted(pixels: NDArray[np.uint8], rating: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Pale a picture and tint it, the more the less a pixel is sure."""
    grey = pixels.astype(np.float64).mean(axis=-1, keepdims=True) * 0.6
    weight = np.where(rating < 1, 0.35 + 0.65 * (1 - rating), 0.0)[..., None]
    mixed = (1 - weight) * grey + weight * TINT
    return np.asarray(np.rint(np.clip(mixed, 0, 255)), dtype=np.uint8)
