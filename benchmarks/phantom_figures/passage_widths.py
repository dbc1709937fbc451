"""How wide a phantom's ways are: balls that pass from one place to another.

A ball's centre is a voxel, so its radius comes out too small, by up to half a voxel.
"""

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from anatomy.frame import lps_from_ras
from anatomy.phantom.ethmoid import ethmoid
from anatomy.phantom.parameters import PhantomParameters
from anatomy.phantom.phantom import Phantom, build_phantom
from anatomy.tissue import Label, Side
from system import UserError

Voxel = tuple[int, ...]

_WIDEST_MM = 6.0
_HALVINGS = 9
_CELL_MM = 0.25
"""Voxel for the narrow ways of the ethmoid cells."""


def half_head(
    parameters: PhantomParameters, side: Side, spacing_mm: float = 0.35
) -> Phantom:
    """Build one side of the nose with what drains into it, cut off at the septum."""
    x = (0.3, 20.0) if side == Side.LEFT else (-20.0, -0.3)
    box = (x, (-17.0, 62.0), (-8.0, 68.0))
    return build_phantom(parameters, spacing_mm, field_mm=box)


def voxel_at(phantom: Phantom, place_mm: NDArray[np.floating], slack: int = 3) -> Voxel:
    """Find the most open voxel within `slack` voxels of a place, ``(3,)`` LPS mm."""
    d = phantom.distance.values
    at = np.round((place_mm - phantom.ct.origin_mm) / phantom.spacing_mm)[::-1]
    cut = tuple(slice(max(int(a) - slack, 0), int(a) + slack + 1) for a in at)
    inner = np.unravel_index(int(np.argmin(d[cut])), d[cut].shape)
    return tuple(c.start + int(i) for c, i in zip(cut, inner, strict=True))


def deepest(phantom: Phantom, label: Label) -> Voxel:
    """Find the most open voxel of a label."""
    d = np.where(phantom.labels.values == label, phantom.distance.values, np.inf)
    return tuple(int(i) for i in np.unravel_index(int(np.argmin(d)), d.shape))


def widest_mm(
    distance_mm: NDArray[np.floating], start: Voxel, goals: list[Voxel]
) -> float:
    """Find the radius of the widest ball that passes from `start` to any goal, mm.

    distance_mm: ``(z, y, x)``, negative in air. Found by halving, to 0.012 mm; 0 if
    there is no way.
    """
    low, high = 0.0, _WIDEST_MM
    for _ in range(_HALVINGS):
        radius = 0.5 * (low + high)
        pieces, _ = ndimage.label(distance_mm < -radius)
        joined = pieces[start] > 0 and any(pieces[start] == pieces[g] for g in goals)
        low, high = (radius, high) if joined else (low, radius)
    return low


def entrance_radii_mm(phantom: Phantom, side: Side) -> dict[str, float]:
    """Measure the widest ball from the nostril to choana and middle meatus."""
    name = side.name.lower()
    at = {
        place: voxel_at(phantom, phantom.landmarks[f"{place}, {name}"].position_mm)
        for place in ("nostril", "choana", "middle meatus")
    }
    start = at.pop("nostril")
    d = phantom.distance.values
    return {place: widest_mm(d, start, [goal]) for place, goal in at.items()}


def ostium_diameters_mm(phantom: Phantom, side: Side) -> dict[str, float]:
    """Measure the widest ball from each large sinus to the choana, as a diameter.

    A frontal sinus that the side lacks is passed over.
    """
    choana = phantom.landmarks[f"choana, {side.name.lower()}"].position_mm
    goals = [voxel_at(phantom, choana)]
    labels = {
        "maxillary": Label.MAXILLARY_AIR,
        "sphenoid": Label.SPHENOID_AIR,
        "frontal": Label.FRONTAL_AIR,
    }
    d = phantom.distance.values
    return {
        sinus: 2 * widest_mm(d, deepest(phantom, label), goals)
        for sinus, label in labels.items()
        if sinus != "frontal" or phantom.parameters.scale("frontal", side) > 0
    }


def nearest_mm(phantom: Phantom, side: Side, ostium: str, diameter_mm: float) -> float:
    """Measure how near the centre of a ball from the nostril comes to an ostium.

    Raise UserError for an ostium that the side does not have.
    """
    marks, name = phantom.landmarks, side.name.lower()
    if f"{ostium} ostium, {name}" not in marks:
        raise UserError(f"the {name} side of this head has no {ostium} ostium")
    start = voxel_at(phantom, marks[f"nostril, {name}"].position_mm)
    pieces, _ = ndimage.label(phantom.distance.values < -diameter_mm / 2)
    if pieces[start] == 0:
        return float("inf")
    open_to = np.argwhere(pieces == pieces[start])[:, ::-1]
    place = phantom.ct.origin_mm + phantom.spacing_mm * open_to
    off = place - marks[f"{ostium} ostium, {name}"].position_mm
    return float(np.linalg.norm(off, axis=1).min())


def cell_diameters_mm(parameters: PhantomParameters, side: Side) -> list[float]:
    """Measure each ethmoid cell's widest way to any other cell of its group."""
    sign = 1.0 if side == Side.RIGHT else -1.0
    x = (-18.0, -4.0) if side == Side.RIGHT else (4.0, 18.0)
    box = (x, (12.0, 55.0), (20.0, 54.0))
    phantom = build_phantom(parameters, _CELL_MM, field_mm=box)
    cells = ethmoid(parameters, side)
    found = []
    for seeds in (cells.anterior_seeds, cells.posterior_seeds):
        places = lps_from_ras(np.array(seeds) * [sign, 1.0, 1.0])
        at = [voxel_at(phantom, place, 2) for place in places]
        for cell in at:
            others = [a for a in at if a != cell]
            found.append(2 * widest_mm(phantom.distance.values, cell, others))
    return found
