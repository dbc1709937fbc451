"""A surface that can be cut and wetted in place, in plain numpy."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from renderers.scene import AirSurface, Change, ChangeKind, Volume, Wounds

FLESH_MM, BONE_MM = 0.8, 0.4


class WoundedSurface:
    """A surface whose distance, blood and film are edited in place.

    flesh, bone: codes of the plate that lies behind it everywhere. deep: of what lies
    beyond.
    """

    def __init__(
        self, pristine: AirSurface, flesh: int = 40, bone: int = 20, deep: int = 0
    ) -> None:
        distance = pristine.distance
        shape = distance.shape
        self.distance = distance.values.copy()
        self.blood = pristine.blood.values.copy()
        self.film: NDArray[np.uint8] = np.zeros(shape, np.uint8)
        self.pale: NDArray[np.uint8] = np.zeros(shape, np.uint8)
        self._grid = distance
        self._pristine = pristine
        self._generation = 0

        def volume(value: int) -> Volume:
            return distance.with_values(np.full(shape, value, np.uint8), 0.0)

        wounds = Wounds(
            distance,
            volume(flesh),
            volume(bone),
            volume(deep),
            distance.with_values(self.film, 0.0),
            distance.with_values(self.pale, 0.0),
        )
        self.surface = replace(
            pristine,
            distance=distance.with_values(self.distance, distance.background),
            blood=pristine.blood.with_values(self.blood, 0.0),
            wounds=wounds,
        )

    def places(self) -> NDArray[np.float64]:
        """Return where the voxels are, ``(nz, ny, nx, 3)`` mm."""
        k, j, i = np.indices(self._grid.shape)
        m = self._grid.world_from_voxel
        found: NDArray[np.float64] = np.stack([i, j, k], -1) @ m[:3, :3].T + m[:3, 3]
        return found

    def cut(self, middle_mm: NDArray[np.float64], radius_mm: float) -> Change:
        """Take a ball away."""
        ball = np.linalg.norm(self.places() - middle_mm, axis=-1) - radius_mm
        carved = np.minimum(self.distance, ball).astype(np.float32)
        # deep in tissue nobody asks how far the air is
        carved = np.where(ball < 2.0, carved, self.distance)
        return self._write(self.distance, carved, ChangeKind.CUT)

    def wet(
        self, middle_mm: NDArray[np.float64], reach_mm: float, thick_mm: float
    ) -> Change:
        """Lay blood on the surface around a place; it thins out to its edge."""
        away = np.linalg.norm(self.places() - middle_mm, axis=-1) / reach_mm
        film = 100 * thick_mm * np.clip(1 - away**2, 0, 1)
        film = np.where(np.abs(self.distance) < 1.5, film, 0)
        film = np.maximum(np.clip(np.rint(film), 0, 255), self.film)
        return self._write(self.film, film.astype(np.uint8), ChangeKind.FILM)

    def redden(self, middle_mm: NDArray[np.float64], reach_mm: float) -> Change:
        """Fill tissue around a place with blood."""
        near = np.linalg.norm(self.places() - middle_mm, axis=-1) < reach_mm
        blood = np.where(near, 200, self.blood).astype(np.uint8)
        return self._write(self.blood, blood, ChangeKind.CUT)

    def inject(self, middle_mm: NDArray[np.float64], reach_mm: float) -> Change:
        """Pale tissue around a place."""
        away = np.linalg.norm(self.places() - middle_mm, axis=-1) / reach_mm
        pale = np.maximum(np.rint(255 * np.clip(1 - away, 0, 1)), self.pale)
        return self._write(self.pale, pale.astype(np.uint8), ChangeKind.TINT)

    def dry(self) -> Change:
        """Take all blood away."""
        return self._write(self.film, np.zeros_like(self.film), ChangeKind.FILM)

    def heal(self) -> Change:
        """Undo all cuts."""
        pristine = self._pristine.distance.values
        return self._write(self.distance, pristine, ChangeKind.CUT)

    def _write(
        self, array: NDArray[np.generic], new: NDArray[np.generic], kind: ChangeKind
    ) -> Change:
        self._generation += 1
        changed = np.argwhere(array != new)[:, ::-1]
        array[:] = new
        if not len(changed):
            changed = np.zeros((1, 3), np.int64)
        low, high = changed.min(axis=0), changed.max(axis=0)
        return Change(self._generation, low, high, kind)
