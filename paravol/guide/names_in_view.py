"""What is seen in a picture, by name: landmarks, and the tissue at one place."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderers.scene import Camera, Volume
from scenarios.clearance import Clearance
from scenarios.structures import TISSUE, Structures
from scenarios.tasks.rules import is_in_sight

FARTHEST_MM = 45.0
"""What lies farther away is not named."""

_STEP_MM = 0.25


@dataclass(frozen=True, slots=True)
class NameMark:
    """A name and where it belongs: shares of the picture's width and height."""

    name: str
    x: float
    y: float


def names_in_view(
    camera: Camera,
    distance: Volume,
    landmarks: Mapping[str, NDArray[np.float64]],
    structures: Structures | None,
    at: tuple[float, float] = (0.5, 0.5),
) -> tuple[NameMark, ...]:
    """Return the landmarks that a camera sees, the nearest first; before all, what
    lies at one place of the picture.

    distance: signed air distance, mm, negative in air. at: shares of the picture.
    """
    eye = camera.frame[0]
    named = _at_place(camera, distance, structures, at)
    found: list[tuple[float, NameMark]] = []
    for name, place in landmarks.items():
        away = place - eye
        length = float(np.linalg.norm(away))
        if not 0.0 < length <= FARTHEST_MM or float(away @ camera.frame[3]) <= 0.0:
            continue
        (column, row), _ = camera.project(place)
        x, y = float(column) / camera.width, float(row) / camera.height
        if np.hypot(x - 0.5, y - 0.5) > 0.5:
            continue
        if is_in_sight(distance, eye, place):
            found.append((length, NameMark(name, x, y)))
    found.sort(key=lambda each: each[0])
    return *named, *(mark for _, mark in found)


def _at_place(
    camera: Camera,
    distance: Volume,
    structures: Structures | None,
    at: tuple[float, float],
) -> tuple[NameMark, ...]:
    """Return the name of the tissue at a place of the picture, where it has one."""
    if structures is None:
        return ()
    small = camera.with_size(65, 65)
    row, column = (min(max(int(65 * share), 0), 64) for share in (at[1], at[0]))
    where = np.zeros((65, 65), np.bool_)
    where[row, column] = True
    origins, ways = small.rays(where)
    along = np.arange(0.0, FARTHEST_MM, _STEP_MM)[:, None]
    line = origins[0] + along * ways[0]
    hit = np.flatnonzero(distance.sample(line) > 0.0)
    if not ways[0].any() or not len(hit):
        return ()
    name = structures.touched(Clearance(0.0, line[max(int(hit[0]) - 1, 0)]))
    return () if name == TISSUE else (NameMark(name, *at),)
