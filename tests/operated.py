"""A small head whose arrays are edited in place, as by whoever operates."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from renderers.scene import AirSurface, Change, ChangeKind, Scene, Volume, Wounds


@dataclass
class Operated:
    """A scene and the arrays under it.

    scene: shows what the arrays hold now. before: the scene as it was.
    """

    before: Scene
    scene: Scene
    distance: NDArray[np.float32]
    film: NDArray[np.uint8]
    ct: NDArray[np.int16]
    pale: NDArray[np.uint8]
    generation: int = 0

    @classmethod
    def of(cls, before: Scene) -> "Operated":
        surface = before.surface
        assert surface is not None
        distance = surface.distance.values.copy()
        ct = before.volume.values.copy()
        film = np.zeros(distance.shape, np.uint8)
        pale = np.zeros(distance.shape, np.uint8)
        rng = np.random.default_rng(3)

        def layer(values: NDArray[np.uint8]) -> Volume:
            return surface.distance.with_values(values, 0.0)

        shape = distance.shape
        wounds = Wounds(
            surface.distance,
            layer(rng.integers(20, 80, shape, np.uint8)),
            layer(rng.integers(0, 40, shape, np.uint8)),
            layer(255 * rng.integers(0, 2, shape, np.uint8)),
            layer(film),
            layer(pale),
        )
        carved = surface.distance.with_values(distance, surface.distance.background)
        scene = replace(
            before,
            volume=before.volume.with_values(ct, before.volume.background),
            surface=AirSurface(carved, surface.blood, surface.skin, wounds),
        )
        return cls(before, scene, distance, film, ct, pale)

    @property
    def surface(self) -> AirSurface:
        assert self.scene.surface is not None
        return self.scene.surface

    def bite(self, place: tuple[int, int, int], radius: float) -> Change:
        """Cut a ball out, place (k, j, i) and radius in voxels; leave it wet."""
        at = np.indices(self.distance.shape).T - np.array(place)
        away = np.linalg.norm(at, axis=-1).T - radius
        carved = np.minimum(self.distance, 0.3 * away.astype(np.float32))
        return self._take(carved, np.where(away < 1, 40, self.film), away < 0)

    def inject(self, place: tuple[int, int, int], radius: float) -> Change:
        """Pale a ball, place (k, j, i) and radius in voxels."""
        at = np.indices(self.distance.shape).T - np.array(place)
        away = np.linalg.norm(at, axis=-1).T
        self.pale[away < radius] = 200
        self.generation += 1
        low, high = np.array(place[::-1]) - radius, np.array(place[::-1]) + radius
        top = np.array(self.distance.shape[::-1]) - 1
        ends = np.clip([np.floor(low), np.ceil(high)], 0, top).astype(np.int64)
        return Change(self.generation, ends[0], ends[1], ChangeKind.TINT)

    def undo(self) -> Change:
        """Put everything back."""
        assert self.before.surface is not None
        whole = np.zeros(self.distance.shape, np.bool_)
        return self._take(self.before.surface.distance.values, whole, whole)

    def _take(
        self,
        distance: NDArray[np.float32],
        film: NDArray[np.generic],
        gone: NDArray[np.bool_],
    ) -> Change:
        # air is as thin as anything was, so that the range of values stays
        air = self.before.volume.values.min()
        ct = np.where(gone, air, self.before.volume.values)
        if gone.any():
            ct = np.minimum(ct, self.ct)
        pairs = (self.distance, distance), (self.film, film), (self.ct, ct)
        changed = np.zeros(self.distance.shape, np.bool_)
        for array, now in pairs:
            changed |= array != now
            array[...] = now
        places = np.argwhere(changed)
        if not len(places):
            places = np.zeros((1, 3), np.int64)
        self.generation += 1
        low, high = places.min(axis=0)[::-1].copy(), places.max(axis=0)[::-1].copy()
        return Change(self.generation, low, high)

    def copy(self) -> Scene:
        """Return the scene as it is now, which no later edit touches."""
        surface = self.surface
        assert surface.wounds is not None
        film, pale = surface.wounds.film, surface.wounds.pale
        assert pale is not None
        return replace(
            self.scene,
            volume=_copied(self.scene.volume),
            surface=replace(
                surface,
                distance=_copied(surface.distance),
                wounds=replace(surface.wounds, film=_copied(film), pale=_copied(pale)),
            ),
        )


def _copied(volume: Volume) -> Volume:
    return volume.with_values(volume.values.copy(), volume.background)
