"""What shading keeps of an operated surface, and how it follows edits."""

import numpy as np
from numpy.typing import NDArray

from renderers.scene import AirSurface, Change, Material
from renderers.scene.gbuffer import read_only
from renderers.scene.scene import FILM_UNIT_MM, WOUND_UNIT_MM
from renderers.shading.kernels.wound_marks import (
    GRAIN_MM,
    LUMPS_MM,
    RIDGES_MM,
    SHIFT,
    WoundField,
    WoundRows,
    mark_cubes,
    stain_walls,
)
from renderers.shading.noise import tile_from_mm

TILE_VOXELS = 5.7
"""Of a noise tile's shortest wavelength of 4, per dominant wavelength."""

FLESH_CODE, BONE_CODE = 140, 32
"""Blood codes that stand for raw flesh and for bone in light from wall to wall."""

_ROWS = WoundRows(
    int(Material.RAW_FLESH),
    int(Material.BONE_EDGE),
    int(Material.CUT_BONE),
    int(Material.DEEP_TISSUE),
    int(Material.BLOOD),
)


class WoundLook:
    """Keep what tells shading where a surface is cut, or wet with blood.

    surface: whose arrays are read in place. Without wounds all is empty, and costs
    nothing.
    """

    def __init__(self, surface: AirSurface) -> None:
        self._surface = surface
        wounds = surface.wounds
        shape = surface.distance.shape if wounds is not None else (0, 0, 0)
        cubes = tuple(-(-n // (1 << SHIFT)) for n in shape)
        self._cubes = np.zeros(cubes, np.uint8)
        self._all = wound_field(surface, self._cubes)
        self._none = self._all._replace(cubes=read_only(np.zeros((0, 0, 0), np.uint8)))
        self._near = 2 * float(surface.distance.spacing_mm.max())
        if wounds is not None:
            self._mark(np.zeros(3, np.int64), np.array(shape[::-1], np.int64) - 1)

    @property
    def field(self) -> WoundField:
        """Return what a kernel takes: no cubes where nothing is cut, nor wet."""
        return self._all if self._cubes.any() else self._none

    def update(self, change: Change) -> None:
        """Look again where something changed."""
        if self._surface.wounds is not None:
            self._mark(change.low, change.high)

    def _mark(self, low: NDArray[np.int64], high: NDArray[np.int64]) -> None:
        mark_cubes(
            self._surface.distance.values,
            self._all,
            np.float32(self._near),
            self._cubes,
            low,
            high,
        )


class WallBlood:
    """Hold the blood of walls as cuts and blood on them change it.

    codes: ``(nz, ny, nx)`` uint8, read-only; the surface's own where nobody operates.
    """

    def __init__(self, surface: AirSurface) -> None:
        self._surface = surface
        self.codes: NDArray[np.uint8] = surface.blood.values
        if surface.wounds is None:
            return
        self._codes = np.empty(surface.blood.shape, np.uint8)
        self.codes = read_only(self._codes)
        none = np.zeros((0, 0, 0), np.uint8)
        self._field = wound_field(surface, none)
        last = np.array(surface.blood.shape[::-1], np.int64) - 1
        self._stain(np.zeros(3, np.int64), last)

    def update(self, change: Change) -> None:
        """Look again where something changed."""
        if self._surface.wounds is not None:
            self._stain(change.low, change.high)

    def _stain(self, low: NDArray[np.int64], high: NDArray[np.int64]) -> None:
        surface = self._surface
        stain_walls(
            surface.distance.values,
            self._field,
            surface.blood.values,
            (FLESH_CODE, BONE_CODE),
            np.float32(2 * surface.distance.spacing_mm.max()),
            self._codes,
            low,
            high,
        )


def wound_field(surface: AirSurface, cubes: NDArray[np.uint8]) -> WoundField:
    """Return a surface's wounds as kernels take them.

    cubes: see `WoundField`, changed by their owner. Empty without wounds.
    """
    to_tile = np.stack(
        [
            tile_from_mm(wavelength, TILE_VOXELS, turn)
            for turn, wavelength in enumerate((LUMPS_MM, RIDGES_MM, GRAIN_MM))
        ]
    )
    wounds = surface.wounds
    nothing = read_only(np.zeros((0, 0, 0), np.uint8))
    pristine = read_only(np.zeros((0, 0, 0), np.float32))
    layers = np.zeros(0, np.uint16)
    deep = film = nothing
    if wounds is not None:
        pristine = wounds.pristine.values
        layers = wounds.bone.values.astype(np.uint16)
        layers <<= 8
        layers |= wounds.flesh.values
        deep, film = wounds.deep.values, wounds.film.values
    return WoundField(
        pristine,
        read_only(layers.reshape(-1)),
        deep,
        film,
        read_only(cubes),
        read_only(to_tile),
        np.float32(WOUND_UNIT_MM),
        np.float32(FILM_UNIT_MM),
        _ROWS,
    )
