"""Which structure of the head a tool touches."""

import hashlib
import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from renderers.scene import Volume
from scenarios.clearance import Clearance

TISSUE = "tissue"
"""What is touched in a head whose places have no names."""

MUCOSA = "mucosa"
"""What is touched far from every named place."""

NAMES = {
    "inferior turbinate": "inferior turbinate",
    "middle turbinate": "middle turbinate",
    "superior turbinate": "superior turbinate",
    "septal cartilage": "septum",
    "septal bone": "septum",
    "uncinate": "uncinate process",
    "polyp": "polyp",
    "basal lamella": "basal lamella",
    "lamina papyracea": "lamina papyracea",
    "cribriform": "cribriform plate",
    "fovea": "fovea ethmoidalis",
    "teeth": "teeth",
    "skin": "skin",
}
"""Structures by the names of their labels. Mucosa is everywhere: it has the name of
what it covers, or of the place it is near."""

THROUGH_MM = 3.0
"""Mucosa is at most this thick where it covers a named structure."""

NEAR_MM = 12.0
"""A landmark farther away than this does not name a place."""

_STEP_MM = 0.25
_DEPTHS_MM = np.arange(_STEP_MM, THROUGH_MM + _STEP_MM, 2 * _STEP_MM).tolist()
_AROUND_MM = _STEP_MM * np.concatenate([np.zeros((1, 3)), np.eye(3), -np.eye(3)])


@dataclass(frozen=True, slots=True)
class Structures:
    """Name what is at places of a head.

    distance: signed air distance, mm, negative in air. labels: on any grid.
    names: of structures, by the labels' values. landmarks: ``(3,)`` LPS mm, by name.
    airs: names of rooms of air, by the labels' values; they name no contact.
    """

    distance: Volume
    labels: Volume
    names: Mapping[int, str]
    landmarks: Mapping[str, NDArray[np.float64]]
    airs: Mapping[int, str] = field(default_factory=dict)
    _keys: tuple[str, ...] = field(init=False, repr=False)
    _places: NDArray[np.float64] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        keys = tuple(sorted(self.landmarks))
        places = [self.landmarks[key] for key in keys]
        object.__setattr__(self, "_keys", keys)
        object.__setattr__(self, "_places", np.array(places).reshape(-1, 3))

    @classmethod
    def of(
        cls,
        distance: Volume,
        labels: Volume,
        label_names: Mapping[int, str],
        landmarks: Mapping[str, NDArray[np.float64]],
    ) -> "Structures":
        """Take a head; label_names: of labels as a case has them, such as ``septal
        bone``."""
        names = {v: NAMES[name] for v, name in label_names.items() if name in NAMES}
        airs = {v: name for v, name in label_names.items() if name.endswith(" air")}
        return cls(distance, labels, names, landmarks, airs)

    def touched(self, clearance: Clearance) -> str:
        """Name the structure at a tool's smallest gap, where that is a contact."""
        air_mm, (u, v, w) = self._wall(clearance.at_mm)
        x, y, z = clearance.at_mm.tolist()
        for depth_mm in _DEPTHS_MM:
            far = air_mm + depth_mm
            place = x + far * u, y + far * v, z + far * w
            name = self.names.get(int(self.labels.at_nearest(place, 0)))
            if name is not None and self.distance.at_nearest(place, -1) > 0.0:
                return name
        far = air_mm + _DEPTHS_MM[0]
        return self._near(np.array([x + far * u, y + far * v, z + far * w]))

    def sha256(self) -> str:
        """Hash all that a name depends on, the air distance aside."""
        digest = hashlib.sha256(repr((sorted(self.names.items()), self._keys)).encode())
        digest.update(self._places.tobytes())
        digest.update(repr(self.labels.shape).encode())
        digest.update(self.labels.world_from_voxel.tobytes())
        digest.update(self.labels.values.tobytes())
        return digest.hexdigest()

    def _wall(self, at_mm: NDArray[np.float64]) -> tuple[float, list[float]]:
        """Return the wall's distance and unit direction, zeros for none."""
        values = self.distance.sample(at_mm + _AROUND_MM)
        slope: NDArray[np.float64] = values[1:4] - values[4:]
        length = math.sqrt(slope.dot(slope)) or 1.0
        return -float(values[0]), (slope / length).tolist()

    def _near(self, place_mm: NDArray[np.float64]) -> str:
        if not self._keys:
            return TISSUE
        squares = ((self._places - place_mm) ** 2).sum(axis=1)
        nearest = int(np.argmin(squares))
        if squares[nearest] > NEAR_MM**2:
            return MUCOSA
        return f"mucosa near {self._keys[nearest]}"
