"""Where the nearest hazard lies in the picture, behind what hides it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from anatomy.hazard_volumes import HazardVolumes
from paravol.feedback.shaft_heading import place_in_picture
from paravol.feedback.touch_signs import MARGIN_MM
from scenarios import FrameState
from scenarios.instrument_state import NO_TOOL

BESIDE_MM = 0.5
"""Half the way over which a distance's slope is read: a voxel of a scan."""


@dataclass(frozen=True, slots=True)
class HazardPointer:
    """A line over the picture: from a tool's tip to the nearest hazard.

    begin, end: shares of the picture's width and height, (0, 0) in its upper left
    corner. begin is None where no tool's tip is in view.
    """

    begin: tuple[float, float] | None
    end: tuple[float, float]


def nearest_point_mm(
    hazards: HazardVolumes, name: str, place_mm: NDArray[np.float64]
) -> NDArray[np.float64] | None:
    """Return the point ``(3,)`` of a hazard nearest to a place, LPS mm.

    A signed distance d rises straight away from the nearest point, which so is
    p - d grad d / |grad d|. None where it does not rise: in the midst of a hazard, or
    too far from it.
    """
    beside = BESIDE_MM * np.concatenate([np.zeros((1, 3)), np.eye(3), -np.eye(3)])
    found = hazards.distance_mm(name, place_mm + beside)
    slope = (found[1:4] - found[4:7]) / (2.0 * BESIDE_MM)
    rise = float(np.linalg.norm(slope))
    if not rise > 0.5:
        return None
    point: NDArray[np.float64] = place_mm - found[0] * slope / rise
    return point


def hazard_pointer(view: FrameState, hazards: HazardVolumes) -> HazardPointer | None:
    """Return the line to the hazard that is nearest in a view.

    None where none is within the margin, or where it is out of the picture.
    """
    if view.hazard is None or not view.hazard[1] < MARGIN_MM:
        return None
    name = view.hazard[0]
    places = [view.world_from_tip[:3, 3]]
    if view.instrument != NO_TOOL:
        places.append(view.world_from_instrument[:3, 3])
    places = [place for place in places if np.all(np.isfinite(place))]
    if not places:
        return None
    gaps = hazards.distance_mm(name, np.array(places))
    place = places[int(np.argmin(gaps))]
    point = nearest_point_mm(hazards, name, place)
    if point is None:
        return None
    end = _in_picture(view, point)
    if end is None:
        return None
    # the scope's own tip is behind the lens
    begin = None if place is places[0] else _in_picture(view, place)
    return HazardPointer(begin, end)


def _in_picture(
    view: FrameState, point_mm: NDArray[np.float64]
) -> tuple[float, float] | None:
    """Return where a point is seen; None beside the lens, or out of the picture."""
    camera = view.camera
    if not float((point_mm - camera.frame[0]) @ camera.frame[3]) > 0.0:
        return None
    at = place_in_picture(camera, point_mm)
    if at is None or not (at[0] - 0.5) ** 2 + (at[1] - 0.5) ** 2 <= 0.25:
        return None
    return at
