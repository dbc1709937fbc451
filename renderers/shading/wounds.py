"""What shading keeps of an operated surface, and how it follows edits."""

import numpy as np
from numpy.typing import NDArray

from renderers.scene import AirSurface, Change, ChangeKind, Material
from renderers.scene.gbuffer import read_only
from renderers.scene.scene import FILM_UNIT_MM, WOUND_UNIT_MM
from renderers.shading.kernels.pushed_block import PushedField
from renderers.shading.kernels.wound_cubes import mark_cubes
from renderers.shading.kernels.wound_marks import (
    AROUND,
    GRAIN_MM,
    LUMPS_MM,
    RIDGES_MM,
    SHIFT,
    WoundField,
    WoundRows,
    stain_walls,
)
from renderers.shading.noise import tile_from_mm

TILE_VOXELS = 5.7
"""Of a noise tile's shortest wavelength of 4, per dominant wavelength."""

PALE_LEFT = 0.15
"""Share of its blood that injected mucosa keeps: a design value, paler than
decongestion leaves it."""

FLESH_CODE, BONE_CODE = 140, 32
"""Blood codes that stand for raw flesh and for bone in light from wall to wall."""

_ROWS = WoundRows(
    int(Material.RAW_FLESH),
    int(Material.BONE_EDGE),
    int(Material.CUT_BONE),
    int(Material.DEEP_TISSUE),
    int(Material.BLOOD),
)


class WoundCubes:
    """Keep which cubes of a grid have a cut surface, or blood on one.

    cubes: see `mark_cubes`, read-only; empty where nobody operates. box: ``(6,)`` low
    and high voxel coordinates around those that have anything. surface: whose
    arrays are read in place. shift, around: see there.
    """

    def __init__(self, surface: AirSurface, shift: int, around: int) -> None:
        self._surface = surface
        self._reach = shift, around
        shape = surface.distance.shape if surface.wounds is not None else (0, 0, 0)
        self._cubes = np.zeros([-(-n // (1 << shift)) for n in shape], np.uint8)
        self.cubes = read_only(self._cubes)
        self._box = np.zeros(6, np.float32)
        self.box = read_only(self._box)
        self._near = 2 * float(surface.distance.spacing_mm.max())
        self._mark(np.zeros(3, np.int64), np.array(shape[::-1], np.int64) - 1)

    @property
    def is_any(self) -> bool:
        """Return whether anything is cut, or wet."""
        return bool(self._cubes.any())

    def update(self, change: Change) -> None:
        """Look again where something changed."""
        self._mark(change.low, change.high)

    def _mark(self, low: NDArray[np.int64], high: NDArray[np.int64]) -> None:
        wounds = self._surface.wounds
        if wounds is None:
            return
        mark_cubes(
            self._surface.distance.values,
            wounds.pristine.values,
            wounds.film.values,
            np.float32(self._near),
            self._cubes,
            *self._reach,
            low,
            high,
        )
        # a voxel more: what lies beside the grid counts to its outermost cubes
        found = np.argwhere(self._cubes)[:, ::-1] << self._reach[0]
        if len(found):
            self._box[:3] = found.min(axis=0) - 1
            self._box[3:] = found.max(axis=0) + (1 << self._reach[0]) + 1


class WoundLook:
    """Keep what tells shading where a surface is cut, wet with blood, or pushed.

    surface: whose arrays are read in place.
    """

    def __init__(self, surface: AirSurface) -> None:
        self._cubes = WoundCubes(surface, SHIFT, AROUND)
        self._all = wound_field(surface, self._cubes.cubes, self._cubes.box)
        none = read_only(np.zeros((0, 0, 0), np.uint8))
        self._none = self._all._replace(cubes=none)

    @property
    def field(self) -> WoundField:
        """Return what a kernel takes: no cubes where nothing is cut, nor wet."""
        return self._all if self._cubes.is_any else self._none

    def update(self, change: Change) -> None:
        """Look again where something changed."""
        self._cubes.update(change)


def blood_codes(
    surface: AirSurface, here: tuple[slice, ...] = (slice(None),) * 3
) -> NDArray[np.uint8]:
    """Return the blood codes of a part of the tissue, as injections have paled it."""
    blood = surface.blood.values[here]
    if surface.wounds is None or surface.wounds.pale is None:
        return blood
    pale = surface.wounds.pale.values[here]
    if not pale.any():
        return blood
    # codes are roots of blood content
    kept = np.sqrt(1.0 - (1.0 - PALE_LEFT) / 255.0 * np.arange(256)).astype(np.float32)
    return np.where(pale > 0, np.rint(blood * kept[pale]), blood).astype(np.uint8)


class WallBlood:
    """The blood of walls as cuts, blood on them and injections change it.

    codes: ``(nz, ny, nx)`` uint8, read-only; the surface's own where nobody operates.
    """

    def __init__(self, surface: AirSurface) -> None:
        self._surface = surface
        self.codes: NDArray[np.uint8] = surface.blood.values
        if surface.wounds is None:
            return
        turn = surface.distance.voxel_from_world[:3, :3]
        self._to_voxel = read_only(np.ascontiguousarray(turn, np.float32))
        self._healthy: NDArray[np.uint8] = surface.blood.values
        if surface.wounds.pale is not None and surface.wounds.pale.values.any():
            self._healthy = blood_codes(surface)
        self._codes = np.empty(surface.blood.shape, np.uint8)
        self.codes = read_only(self._codes)
        none = read_only(np.zeros((0, 0, 0), np.uint8))
        self._field = wound_field(surface, none, read_only(np.zeros(6, np.float32)))
        last = np.array(surface.blood.shape[::-1], np.int64) - 1
        self._stain(np.zeros(3, np.int64), last)

    def update(self, change: Change) -> None:
        """Look again where something changed."""
        if self._surface.wounds is None:
            return
        low, high = change.low, change.high
        is_own = self._healthy is not self._surface.blood.values
        if change.kind is ChangeKind.TINT and not is_own:
            self._healthy, is_own = self._healthy.copy(), True
        if is_own and change.kind is not ChangeKind.FILM:
            here = tuple(slice(low[a], high[a] + 1) for a in (2, 1, 0))
            self._healthy[here] = blood_codes(self._surface, here)
        box = self._field.pushed.box
        if change.kind in (ChangeKind.FILM, ChangeKind.TINT) and np.all(
            (high >= box[:3]) & (low <= box[3:])
        ):
            # what is told where it lies may be shown elsewhere
            low = np.minimum(low, np.maximum(box[:3], 0)).astype(np.int64)
            top = np.array(self._codes.shape[::-1]) - 1
            high = np.maximum(high, np.minimum(box[3:], top)).astype(np.int64)
        self._stain(low, high)

    def _stain(self, low: NDArray[np.int64], high: NDArray[np.int64]) -> None:
        surface = self._surface
        stain_walls(
            surface.distance.values,
            self._field,
            self._healthy,
            (FLESH_CODE, BONE_CODE),
            np.float32(2 * surface.distance.spacing_mm.max()),
            self._codes,
            low,
            high,
            self._to_voxel,
        )


def pushed_field(surface: AirSurface) -> PushedField:
    """Return where a surface's tissue lies at rest, as kernels take it."""
    rest = surface.rest
    if rest is None:
        none = read_only(np.zeros((0, 0, 0), np.float32))
        return PushedField(none, none, none, read_only(np.zeros(6, np.float32)))
    return PushedField(rest.x.values, rest.y.values, rest.z.values, read_only(rest.box))


def wound_field(
    surface: AirSurface, cubes: NDArray[np.uint8], box: NDArray[np.float32]
) -> WoundField:
    """Return a surface's wounds as kernels take them.

    cubes, box: of `WoundCubes`. Empty without wounds.
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
    film = nothing
    if wounds is not None:
        pristine = wounds.pristine.values
        thickness = wounds.bone.values
        layers = np.where(wounds.deep.values > 127, 255, thickness).astype(np.uint16)
        layers <<= 8
        layers |= wounds.flesh.values
        film = wounds.film.values
    return WoundField(
        pristine,
        read_only(layers.reshape(-1)),
        film,
        cubes,
        box,
        read_only(to_tile),
        np.float32(WOUND_UNIT_MM),
        np.float32(FILM_UNIT_MM),
        _ROWS,
        pushed_field(surface),
    )
