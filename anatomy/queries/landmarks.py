"""Named places of the head, in world millimetres."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from anatomy.frame import lps_from_ras
from anatomy.phantom.ethmoid import RETROBULBAR, lamina_papyracea, suprabullar
from anatomy.phantom.frontal_cells import SUPRAORBITAL
from anatomy.phantom.parameters import PhantomParameters
from anatomy.phantom.plates import LAMINA_GAP, LAMINA_GAP_MM
from anatomy.phantom.sinuses import SEPTAL_CELL, accessory_place
from anatomy.phantom.sphenoid import pneumatization, sphenoid_middle
from anatomy.tissue import Side


@dataclass(frozen=True, slots=True)
class Landmark:
    """Name a place. position_mm: ``(3,)`` LPS; radius_mm: how far it extends."""

    name: str
    side: Side
    position_mm: NDArray[np.float64]
    radius_mm: float

    @property
    def key(self) -> str:
        """Return the name with its side, such as ``middle turbinate head, left``."""
        if self.side == Side.MIDLINE:
            return self.name
        return f"{self.name}, {self.side.name.lower()}"


_ARTERIES = ("anterior ethmoidal artery", "posterior ethmoidal artery")

# u, y, z, radius
_PAIRED = {
    "nostril": (6.3, 13.0, -6.5, 4.0),
    "nasal valve": (5.4, 2, 10, 2.7),
    "inferior turbinate head": (9, -8, 10, 2.5),
    "inferior turbinate tail": (9.4, -47.5, 11, 2.0),
    "middle turbinate head": (6.3, -16, 24.5, 2.0),
    "middle turbinate axilla": (7.5, -16, 38, 1.5),
    "middle turbinate tail": (6.7, -51, 21.6, 1.2),
    "middle meatus": (9.2, -31, 21.5, 1.2),
    "uncinate process": (9.6, -20, 28, 1.5),
    "hiatus semilunaris": (9, -27, 24.3, 1.3),
    "ethmoid bulla": (9.8, -28.2, 27, 3.0),
    "maxillary ostium": (13, -27.4, 23.2, 2.0),
    "maxillary sinus": (26, -28, 12, 10.0),
    "frontal ostium": (8, -11.5, 54.5, 2.4),
    "frontal sinus": (11.4, -5, 66.3, 6.8),
    "agger nasi": (8.4, -8.2, 38.5, 2.8),
    "basal lamella": (9, -34.0, 38.1, 1.0),
    "superior turbinate": (5.0, -45, 36, 1.0),
    "sphenoethmoidal recess": (3.3, -47, 29.5, 1.5),
    "sphenoid ostium": (3.6, -53.5, 34.5, 1.55),
    "choana": (6, -54.5, 12, 5.0),
    "eustachian orifice": (12.2, -62, 6.3, 2.2),
    "Rosenmueller fossa": (14.5, -72.2, 8.5, 2.0),
    "sphenoid sinus": (9.2, -66.5, 34.5, 9.0),
    "sphenoid lateral recess": (17, -60.3, 25.6, 2.0),
    "optic canal": (17, -47, 42, 2.2),
    "carotid bulge": (12.5, -69.0, 36.0, 2.5),
    "opticocarotid recess": (12.6, -62.5, 40.0, 1.2),
    "vidian canal": (14.8, -52.4, 23.2, 1.0),
    "foramen rotundum": (18.8, -54.0, 28.6, 1.3),
    "infraorbital canal": (26.5, -23.0, 23.8, 0.9),
    "superior orbital fissure": (17.2, -53.5, 39.2, 2.0),
    "pterygopalatine fossa": (16.4, -49.2, 24.5, 2.0),
    "sphenopalatine foramen": (13.2, -50.3, 24, 2.5),
    "lamina dehiscence": (LAMINA_GAP[0], LAMINA_GAP[1], LAMINA_GAP[2], LAMINA_GAP_MM),
    "anterior ethmoidal artery": (9, -24, 51.4, 0.5),
    "posterior ethmoidal artery": (15.5, -38.6, 49.0, 0.5),
    "lacrimal duct opening": (12.5, -12, 7, 1.4),
    "ethmoid roof": (9, -22, 51.5, 1.0),
    "olfactory fossa": (2.4, -26, 51.1, 1.4),
    "retrobulbar recess": (*RETROBULBAR, 2.0),
    "suprabullar cell": (9.2, -26.3, 43.6, 2.2),
    "supraorbital cell": (*SUPRAORBITAL, 1.4),
    "frontal septal cell": (*SEPTAL_CELL, 1.6),
    "accessory maxillary ostium": (13.6, -35.8, 20.2, 1.5),
}
VARIANT_PLACES = {
    "agger-nasi": "agger nasi",
    "retrobulbar-recess": "retrobulbar recess",
    "suprabullar-cell": "suprabullar cell",
    "supraorbital-cell": "supraorbital cell",
    "frontal-septal-cell": "frontal septal cell",
    "accessory-ostium": "accessory maxillary ostium",
    "lateral-recess": "sphenoid lateral recess",
}
"""Landmarks that only a side with the variant has."""

_MIDLINE = {
    "anterior nasal spine": (0, 0, 0, 1.0),
    "nasofrontal beak": (0, -3, 51, 2.0),
    "nasopharynx": (0, -66, 8, 6.0),
    "sella turcica": (0, -72.5, 42.0, 3.5),
}


def landmarks(parameters: PhantomParameters) -> dict[str, Landmark]:
    """List the landmarks of one head by `Landmark.key`, both sides.

    The septum's deviation shifts them as it shifts the anatomy around them. What a
    side lacks has no landmark: see `lacking`.
    """

    def sized(name: str, side: Side) -> tuple[float, float, float, float]:
        """Move the middles of the sinuses with their sizes."""
        values = _PAIRED[name]
        if name in ("ethmoid roof", *_ARTERIES):
            drop = 3.0 if parameters.has("hanging-artery", side) else 0.0
            sunk = drop if name == "anterior ethmoidal artery" else 0.0
            a, b, c, radius = values
            return a, b, c + parameters.roof_mm - sunk, radius
        if name == "olfactory fossa":
            a, b, c, radius = values
            return a, b, c + 0.88 * parameters.roof_mm - parameters.keros(side), radius
        if name == "suprabullar cell":
            return *suprabullar(parameters), values[3]
        if name == "accessory maxillary ostium":
            return *accessory_place(parameters, side), values[3]
        if name == "frontal sinus":
            q = max(parameters.scale("frontal", side), 0.5)
            return 2.6 + 7.2 * q, -5.2, 56.0 + 9.0 * q**0.6, 6.0 * q**0.5
        if name == "sphenoid sinus":
            (a, b, c), radius = sphenoid_middle(parameters, side)
            return a, b, c, radius
        if name == "lamina dehiscence":
            a, b, c, radius = values
            where = np.array([[a], [b], [c]])
            wall = lamina_papyracea(parameters, side).evaluate(where)
            return float(wall[0]), b, c, radius
        if name == "maxillary sinus":
            k = parameters.scale("maxillary", side)
            return 14.6 + 11.4 * k, -28.0, 25.0 - 13.0 * k, 10.0 * k
        return values

    found = [
        _place(name, Side.MIDLINE, values, parameters)
        for name, values in _MIDLINE.items()
    ]
    for side in (Side.RIGHT, Side.LEFT):
        absent = lacking(parameters, side)
        found += [
            _place(name, side, sized(name, side), parameters)
            for name in _PAIRED
            if name not in absent
        ]
    return {landmark.key: landmark for landmark in found}


def lacking(parameters: PhantomParameters, side: Side) -> frozenset[str]:
    """Name the paired landmarks that one side of a head does not have.

    Some cells, recesses and gaps are variants (`VARIANT_PLACES`), as is a second
    maxillary ostium; an aplastic frontal sinus has neither ostium nor septal cell;
    surgery takes the uncinate process and, with it, the hiatus behind its edge. A
    carotid presses into sinuses that reach the sella only.
    """
    absent: set[str] = set()
    for variant, name in VARIANT_PLACES.items():
        if not parameters.has(variant, side):
            absent.add(name)
    if not parameters.has("dehiscent-lamina", side):
        absent.add("lamina dehiscence")
    if pneumatization(parameters, side) in ("conchal", "presellar"):
        absent |= {"carotid bulge", "opticocarotid recess"}
    if parameters.scale("frontal", side) == 0:
        absent |= {"frontal sinus", "frontal ostium", "frontal septal cell"}
    if parameters.is_operated(side):
        absent |= {"uncinate process", "hiatus semilunaris"}
    return frozenset(absent)


def _place(
    name: str,
    side: Side,
    values: tuple[float, float, float, float],
    parameters: PhantomParameters,
) -> Landmark:
    at = np.array(values[:3], dtype=np.float64)
    place = septal_shift(parameters, at, side)
    return Landmark(name, side, place, parameters.head_scale * float(values[3]))


def septal_shift(
    parameters: PhantomParameters, points: NDArray[np.float64], side: Side
) -> NDArray[np.float64]:
    """Turn ``(..., 3)`` points (u, y, z) of one side into LPS places in mm.

    The septum's deviation moves all that is near it; midline points stay.
    """
    placed = np.array(points, dtype=np.float64)
    y, z = placed[..., 1], placed[..., 2]
    deviation = 0.0 if side == Side.MIDLINE else parameters.septal_deviation_mm
    shift = deviation * np.exp(-(((y + 22) / 14) ** 2) - ((z - 16) / 12) ** 2)
    placed[..., 0] = placed[..., 0] * (-1.0 if side == Side.LEFT else 1.0) + shift
    return lps_from_ras(parameters.head_scale * placed)
