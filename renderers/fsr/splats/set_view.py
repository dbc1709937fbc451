"""One view of a set: what all strips of its picture have in common."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderers.fsr.display_list import lens_planes
from renderers.fsr.footprint import (
    CUT_SIGMAS,
    SHEET_SIGMA_PER_SPACING,
    SIGMA_PER_SPACING,
)
from renderers.fsr.kernels.view_planes import bring_into_grid, strip_planes
from renderers.fsr.splats.grid_view import View, view_of
from renderers.fsr.splats.near_splats import WIDEST_SIGMA
from renderers.fsr.splats.shaded_set import PaintedSet
from renderers.fsr.splats.splat_mode import SplatMode, Traversal
from renderers.fsr.splats.splat_tiles import MOST_TILES, TILE_SIDE
from renderers.fsr.tile_grid import tile_grid
from renderers.scene import Camera


@dataclass(frozen=True, slots=True)
class SetView:
    """Hold a camera and what it means for a set.

    tiles: down and across the picture. sigma_mm: of a splat. near_mm: those nearer are
    drawn first; minus infinity in a flat view. planes: ``(p, 4)`` around the view, see
    `lens_planes`, in grid places counted from the view's base. sheets: lowest depth,
    keys per mm and keys per sheet, as kernels take them; empty where splats are blended
    one by one.
    """

    painted: PaintedSet
    camera: Camera
    mode: SplatMode
    traversal: Traversal
    tiles: tuple[int, int]
    view: View
    sigma_mm: float
    near_mm: float
    planes: NDArray[np.float32]
    sheets: NDArray[np.float32]

    @property
    def all_tiles(self) -> range:
        """Get the numbers of all tiles, row by row."""
        return range(self.tiles[0] * self.tiles[1])

    def planes_of(self, strip: range) -> NDArray[np.float32]:
        """Bound what may show in a strip of tiles, by planes in grid places.

        These are counted from the view's base. See `strip_planes`.
        """
        if len(strip) == len(self.all_tiles):
            return self.planes
        camera, across = self.camera, self.tiles[1]
        within = strip_planes(
            int(camera.projection),
            camera.extent,
            camera.width,
            camera.height,
            strip.start // across * TILE_SIDE,
            -(-strip.stop // across) * TILE_SIDE,
            _radius_mm(self.painted),
            self.near_mm,
            self.view.low,
        )
        count = len(self.planes)
        planes = np.empty((count + len(within), 4), np.float32)
        planes[:count] = self.planes
        matrix = self.painted.rows.world_from_voxel
        bring_into_grid(
            within, camera.frame, 0.0, matrix, self.view.base, planes[count:]
        )
        return planes


def see_set(
    painted: PaintedSet,
    camera: Camera,
    mode: SplatMode,
    traversal: Traversal = Traversal.DISTANCE,
) -> SetView:
    """Find what a view asks of a set.

    Raises ValueError for sheets in another order than that of distance, and for a
    picture of too many pixels.
    """
    if mode is SplatMode.SHEET and traversal is not Traversal.DISTANCE:
        raise ValueError(
            f"sheets are layers of distance, so their splats need the order "
            f"{Traversal.DISTANCE.value!r}, got {traversal.value!r}"
        )
    size = camera.height, camera.width
    tiles = tile_grid(*size, (TILE_SIDE, TILE_SIDE), MOST_TILES)
    view = view_of(camera, painted.grid)
    sigma_mm = sigma_of(mode) * painted.widest_mm
    # the parts of a splat that is split may lie behind the next that is not
    near_mm = -math.inf if view.is_flat else sigma_mm / WIDEST_SIGMA + painted.widest_mm
    sheets = np.empty(0, np.float32)
    if mode is SplatMode.SHEET:
        keys_per_sheet = view.keys_per_mm * painted.sheet_mm
        sheets = np.array([view.low, view.keys_per_mm, keys_per_sheet], np.float32)
    lens = lens_planes(camera.projection, camera.extent, camera.width, camera.height)
    planes = np.empty(lens.shape, np.float32)
    matrix = painted.rows.world_from_voxel
    bring_into_grid(lens, camera.frame, _radius_mm(painted), matrix, view.base, planes)
    return SetView(
        painted,
        camera,
        mode,
        traversal,
        tiles,
        view,
        sigma_mm,
        near_mm,
        planes,
        sheets,
    )


def sigma_of(mode: SplatMode) -> float:
    """Give a mode's sigma of a footprint, in grid steps."""
    sheet = mode is SplatMode.SHEET
    return SHEET_SIGMA_PER_SPACING if sheet else SIGMA_PER_SPACING


def _radius_mm(painted: PaintedSet) -> float:
    return CUT_SIGMAS * SHEET_SIGMA_PER_SPACING * painted.widest_mm
