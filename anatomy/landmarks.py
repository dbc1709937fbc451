"""Named places of the head, in world millimetres."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from anatomy.frame import lps_from_ras
from anatomy.parameters import PhantomParameters
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
        """Get the name with its side, such as ``middle turbinate head, left``."""
        if self.side == Side.MIDLINE:
            return self.name
        return f"{self.name}, {self.side.name.lower()}"


# u, y, z, radius
_PAIRED = {
    "nostril": (6.3, 13.0, -6.5, 4.0),
    "nasal valve": (5.4, 2, 10, 2.7),
    "inferior turbinate head": (9, -8, 10, 2.5),
    "inferior turbinate tail": (9.4, -48, 10, 2.0),
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
    "basal lamella": (9, -31.5, 36.9, 1.0),
    "superior turbinate": (5.0, -45, 36, 1.0),
    "sphenoethmoidal recess": (3.3, -47, 29.5, 1.5),
    "sphenoid ostium": (3.6, -53.5, 34.5, 1.55),
    "choana": (6, -54.5, 12, 5.0),
    "eustachian orifice": (12.2, -62, 6.3, 2.2),
    "Rosenmueller fossa": (14.5, -72.2, 8.5, 2.0),
    "sphenoid sinus": (9.2, -66.5, 34.5, 9.0),
    "optic canal": (17, -47, 42, 2.2),
    "carotid bulge": (17.5, -76, 36, 2.5),
    "anterior ethmoidal artery": (9, -24, 51.3, 0.5),
    "lacrimal duct opening": (12.5, -12, 7, 1.4),
    "ethmoid roof": (9, -22, 51.5, 1.0),
}
_MIDLINE = {
    "anterior nasal spine": (0, 0, 0, 1.0),
    "nasofrontal beak": (0, -3, 51, 2.0),
    "nasopharynx": (0, -66, 8, 6.0),
}


def landmarks(parameters: PhantomParameters) -> dict[str, Landmark]:
    """List the landmarks of one head by `Landmark.key`, both sides.

    The septum's deviation shifts them as it shifts the anatomy around them.
    """
    found = [
        _place(name, Side.MIDLINE, values, 0.0) for name, values in _MIDLINE.items()
    ]
    for side in (Side.RIGHT, Side.LEFT):
        for name, values in _PAIRED.items():
            found.append(_place(name, side, values, parameters.septal_deviation_mm))
    return {landmark.key: landmark for landmark in found}


def _place(
    name: str, side: Side, values: tuple[float, float, float, float], deviation: float
) -> Landmark:
    u, y, z, radius = values
    shift = deviation * np.exp(-(((y + 22) / 14) ** 2) - ((z - 16) / 12) ** 2)
    x = u * (-1.0 if side == Side.LEFT else 1.0) + shift
    return Landmark(name, side, lps_from_ras(np.array([x, y, z])), float(radius))
