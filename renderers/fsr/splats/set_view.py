"""One view of a set: what all bands of its picture have in common."""

import math
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from renderers.fsr.kernels.depth_sort import KEYS
from renderers.fsr.kernels.footprint import CUT, SIGMA_PER_SPACING
from renderers.fsr.kernels.project_splats import Style
from renderers.fsr.kernels.subdivide import LAST_SIGMA, WIDEST_SIGMA
from renderers.fsr.kernels.tile_buffer import MOST_TILES, TILE_SIDE
from renderers.fsr.kernels.view_planes import (
    GridView,
    band_planes,
    bring_into_grid,
    see_grid,
)
from renderers.fsr.splats.shaded_set import ShadedSet
from renderers.fsr.view_bounds import lens_of, lens_planes, tile_grid
from renderers.scene import Camera, Projection

CULLED_SIGMA = 0.65
"""Sigma per spacing that culling allows for: more than a splat has."""


class SplatMode(Enum):
    """Name a way to draw splats, the fastest first.

    POINTS: squares of one opacity and one voxel's size; sheets of them show gaps and
    overlaps, only their mean is right. GAUSSIAN: every splat blended by itself, its
    peak such that a sheet has the right mean opacity, ripple up to six codes.
    """

    POINTS = "points"
    GAUSSIAN = "gaussian"

    @classmethod
    def _missing_(cls, value: object) -> "SplatMode":
        if value == "sheet":
            raise ValueError(
                "splat mode 'sheet' is no more: take 'gaussian', which is at least as "
                "near to a ray caster's picture"
            )
        raise ValueError(f"splats are drawn as 'gaussian' or 'points', got {value!r}")


class Traversal(Enum):
    """Name an order of splats.

    DISTANCE: from the eye, counted, not compared; does not change when the eye only
    turns. GRID: that of 1995, slices, rows and columns from the far side to the eye's
    own, which needs no sort; in a perspective view wide footprints of that slice shine
    through nearer walls beside them.
    """

    DISTANCE = "distance"
    GRID = "grid"


@dataclass(frozen=True, slots=True)
class SetView:
    """A camera and what it means for a set.

    tiles: down and across the picture. view, style: as kernels take them. planes:
    ``(p, 4)`` around the view, see `lens_planes`, in grid places counted from the
    view's base.
    """

    shaded: ShadedSet
    camera: Camera
    traversal: Traversal
    tiles: tuple[int, int]
    view: GridView
    style: Style
    planes: NDArray[np.float32]

    @property
    def all_tiles(self) -> range:
        """Return the numbers of all tiles, row by row."""
        return range(self.tiles[0] * self.tiles[1])

    def planes_of(self, band: range) -> NDArray[np.float32]:
        """Bound what may show in a band of tiles, as `planes` bounds the view."""
        if len(band) == len(self.all_tiles):
            return self.planes
        camera, across = self.camera, self.tiles[1]
        within = band_planes(
            lens_of(camera),
            band.start // across * TILE_SIDE,
            -(-band.stop // across) * TILE_SIDE,
            _culled_radius_mm(self.shaded),
            float(self.view.near_mm),
            float(self.view.low),
        )
        count = len(self.planes)
        planes = np.empty((count + len(within), 4), np.float32)
        planes[:count] = self.planes
        matrix = self.shaded.sparse.world_from_voxel
        bring_into_grid(
            within, camera.frame, 0.0, matrix, self.view.base, planes[count:]
        )
        return planes


def view_set(
    shaded: ShadedSet,
    camera: Camera,
    mode: SplatMode,
    traversal: Traversal = Traversal.DISTANCE,
) -> SetView:
    """Bring a camera into terms of a set.

    Raises ValueError for a picture of too many pixels.
    """
    size = camera.height, camera.width
    tiles = tile_grid(*size, (TILE_SIDE, TILE_SIDE), MOST_TILES)
    is_flat = camera.projection is Projection.ORTHOGRAPHIC
    base, matrix, low, high = see_grid(camera.frame, is_flat, shaded.grid)
    half = 0.5 * min(camera.width, camera.height)
    pinhole = camera.projection is Projection.PERSPECTIVE
    scale = half / (math.tan(camera.extent) if pinhole else camera.extent)
    sigma_mm = SIGMA_PER_SPACING * shaded.widest_mm
    # the parts of a splat that is subdivided may lie behind the next that is not
    near_mm = -math.inf if is_flat else sigma_mm / WIDEST_SIGMA + shaded.widest_mm
    view = GridView(
        base,
        matrix,
        int(camera.projection),
        np.float32(scale),
        camera.width,
        camera.height,
        np.float32(low),
        np.float32(KEYS / max(high - low, 1e-9)),
        np.float32(near_mm),
    )
    style = Style(
        np.float32(SIGMA_PER_SPACING),
        np.float32(LAST_SIGMA**2),
        mode is SplatMode.POINTS,
        np.float32(CUT * SIGMA_PER_SPACING * shaded.widest_mm),
    )
    lens = lens_planes(camera.projection, camera.extent, camera.width, camera.height)
    planes = np.empty(lens.shape, np.float32)
    margin_mm, voxels = _culled_radius_mm(shaded), shaded.sparse.world_from_voxel
    bring_into_grid(lens, camera.frame, margin_mm, voxels, base, planes)
    return SetView(shaded, camera, traversal, tiles, view, style, planes)


def _culled_radius_mm(shaded: ShadedSet) -> float:
    return CUT * CULLED_SIGMA * shaded.widest_mm
