"""The opened head with the way of the scope in it."""

import math

import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray

from paravol.debrief.charts import head
from paravol.debrief.pictures import Picture
from paravol.patient import PatientScene
from paravol.slices.cutaway import Cutaway
from renderers.scene import Camera, Projection

SIZE = 480, 400
HALF_FIELD = math.radians(15.0)
AHEAD = 0.35, 0.12
"""So far to the front and up of the side the eye stands, as shares of its distance."""

HIDDEN_MM = 1.5
"""A point of the way that lies so far behind what is drawn there is hidden by it."""


def head_picture(
    patient: PatientScene, own: list[NDArray[np.float64]], threads: int
) -> Markup:
    """Return the head, opened beside the way, in perspective; hidden ways are dashed.

    own: pieces of the way ``(n, 3)``, LPS mm.
    """
    way = np.concatenate(own)
    cutaway = Cutaway(patient.scene, way[:: max(len(way) // 50, 1)], threads=threads)
    try:
        low, high = way.min(axis=0), way.max(axis=0)
        middle = (low + high) / 2
        reach_mm = float(np.linalg.norm(high - low)) / 2 + 22.0
        away_mm = reach_mm / math.tan(HALF_FIELD)
        eye = middle + away_mm * np.array([cutaway.towards, -AHEAD[0], AHEAD[1]])
        camera = Camera.looking_at(
            eye,
            middle,
            extent=HALF_FIELD,
            size=SIZE,
            projection=Projection.PERSPECTIVE,
        )
        pixels, depth = cutaway.draw(camera)
    finally:
        cutaway.close()
    pieces = [part for piece in own for part in _seen(camera, depth, piece)]
    return head(SIZE, Picture.of(pixels).url, pieces)


def _seen(
    camera: Camera, depth: NDArray[np.float32], piece: NDArray[np.float64]
) -> list[tuple[NDArray[np.float64], bool]]:
    """Return stretches of pixels ``(n, 2)`` and whether tissue hides them."""
    pixels, away = camera.project(piece)
    height, width = depth.shape
    known = np.isfinite(pixels).all(axis=1)
    pixels, away = pixels[known], away[known]
    columns = np.clip(pixels[:, 0].astype(int), 0, width - 1)
    rows = np.clip(pixels[:, 1].astype(int), 0, height - 1)
    is_hidden = away > depth[rows, columns] + HIDDEN_MM
    breaks = np.flatnonzero(np.diff(is_hidden)) + 1
    found = []
    for part in np.split(np.arange(len(pixels)), breaks):
        if len(part) and len(pixels) > 1:
            # on to the next stretch's first point, so that no gap is drawn
            until = min(part[-1] + 2, len(pixels))
            found.append((pixels[part[0] : until], bool(is_hidden[part[0]])))
    return [each for each in found if len(each[0]) > 1]
