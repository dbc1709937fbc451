"""A G-buffer from two sets of surfels: fine ones near the lens, coarse ones beyond."""

import math
import threading
from collections.abc import Callable
from functools import partial
from operator import call

import numpy as np
from numpy.typing import NDArray

from renderers.fsr.deformation import displace_surfels
from renderers.fsr.kernels.draw_surfels import (
    Discs,
    GeometryPlanes,
    SurfelScratch,
    draw_tiles,
)
from renderers.fsr.kernels.project_surfels import (
    RECORD,
    DiscLimits,
    SurfelBuffers,
    project_surfels,
)
from renderers.fsr.kernels.surfel_tiles import (
    MOST_TILES,
    RAY,
    SQUARE,
    SQUARES,
    TILE_HEIGHT,
    TILE_WIDTH,
    tile_by_tile,
)
from renderers.fsr.surfels.crease_tracing import CreaseTracer
from renderers.fsr.surfels.cut_rim_tracing import CutRims
from renderers.fsr.surfels.disc_bounds import disc_bounds
from renderers.fsr.surfels.hole_filling import fill_holes
from renderers.fsr.surfels.occlusion_blocks import (
    BLOCK_SHIFT,
    FAR,
    NEAR,
    Blocks,
    Runs,
    pool_surfels,
)
from renderers.fsr.surfels.rim_sharpening import RimSharpener
from renderers.fsr.surfels.surfel_buffers import lined_up, make_surfel_scratch
from renderers.fsr.surfels.surfel_pool import SurfelPool
from renderers.fsr.surfels.surfel_set import extract_surfels
from renderers.fsr.surfels.surfel_update import BlockExtraction, far_blocks
from renderers.fsr.view_bounds import lens_of, tile_grid
from renderers.fsr.visibility import BlockBounds, VisibleSetLookup, VisibleSets
from renderers.scene import Camera, Change, ChangeKind, GBuffer, Projection, Volume
from renderers.scene.deflection import Deflection, deflected_distance
from renderers.scene.thread_pool import ThreadPool
from renderers.simd.self_check import require_vectors

SIGMA_PER_SPACING = 0.6
"""Wider discs cost detail (SSIM .005 less at .72), narrower ones leave holes."""

RADIUS_SIGMAS = math.sqrt(4.5)
"""The weight (1 - r^2 / 4.5 sigma^2)^2 is close to the Gaussian and ends smoothly. The
longer tail (1 - r^2 / 6 sigma^2)^3 changes no error and costs 15 % more (measured)."""

CORE_SIGMAS2 = 2.9
"""Squared core radius in sigmas; with 1.7 the far wall shows through pinholes."""

BEHIND_MM = 0.6
"""Depth behind the nearest core that belongs to the same surface."""

NEAR_SPACINGS = 24.0
"""Fine surfels nearer than this many coarse spacings (12 mm at 0.5 mm): there a coarse
disc is 20 pixels wide and more, silhouettes grow and small openings close. With 8 mm
an ethmoid cell of 1 mm seen from 10 mm was closed; the surfels are 5 % fewer."""

FACING = 0.004
"""Least cosine to the eye. A wall seen more flatly is less than a pixel high."""

REFRESH = 128
"""Surfels of a tile between two looks at its farthest depths."""

PART = 4096
"""Surfels projected at a time by one thread."""

NEAREST_MM = 1e-3


class SurfelRasterizer:
    """Draw the zero surface of a signed distance field (mm, negative in air).

    Keeps its scratch memory between pictures. hide: leave out what walls hide before
    it is projected. Without, the picture is slower and the same but for pinholes
    between discs, where something hidden may show. sharp: take discs away where they
    stand over a free edge. deflection: moves the surface. creases: of the cuts in it.
    """

    def __init__(
        self,
        distance: Volume,
        *,
        hide: bool = True,
        sharp: bool = True,
        deflection: Deflection | None = None,
        creases: CreaseTracer | None = None,
    ) -> None:
        require_vectors("Drawing surfels")
        self._creases = creases
        coarse, fine = extract_surfels(distance), extract_surfels(distance, refine=2)
        self._cut_rims = None
        if deflection is not None:
            self._cut_rims = CutRims(distance, deflection)
            coarse = displace_surfels(coarse, distance, deflection)
            fine = displace_surfels(fine, distance, deflection)
            distance = deflected_distance(distance, deflection)
        self._distance = distance
        self._lookup: VisibleSetLookup | None = None
        self._blocks = Blocks(distance, coarse.rows, fine.rows)
        self._coarse = pool_surfels(coarse, self._blocks, BLOCK_SHIFT)
        self._fine = pool_surfels(fine, self._blocks, BLOCK_SHIFT + 1)
        self._extraction = BlockExtraction()
        # what surfels were last found in; who edits nothing needs none
        self._before: NDArray[np.float32] | None = None
        self._hide = hide
        self._sharp = sharp
        self._rims = RimSharpener(distance)
        self._buffers = _make_buffers(0)
        self._split = 0
        radius = np.float32(SIGMA_PER_SPACING * RADIUS_SIGMAS) * np.array(
            [self._fine.spacing_mm, self._coarse.spacing_mm], np.float32
        )
        inverses = np.float32(1) / (radius * radius)
        self._inverses = inverses.astype(np.float32, copy=False)
        self._table = np.empty((0, 0, 3), np.float32)
        self._rays = np.empty((0, 0), np.float32)
        self._local = threading.local()
        self.counters: dict[str, int] = {}
        self._has_filled = False

    @property
    def splat_count(self) -> int:
        """Return the number of surfels in both sets."""
        return len(self._coarse) + len(self._fine)

    def bounds(self) -> BlockBounds:
        """Return where the discs of each block are, for sets of visible blocks."""
        reach = SIGMA_PER_SPACING * RADIUS_SIGMAS
        near_mm = BEHIND_MM + 0.5 * self._coarse.spacing_mm
        return disc_bounds(
            (self._coarse, self._fine), self._blocks, self._distance, reach, near_mm
        )

    def use_visible_sets(self, sets: VisibleSets | None) -> None:
        """Use the sets of visible blocks in place of cones, or cones again.

        The pictures are the same. Raises ValueError for sets of other blocks.
        """
        self._lookup = None
        if sets is not None:
            numbers = self._blocks.numbers
            self._lookup = VisibleSetLookup(sets, self._distance, numbers)

    def update(self, change: Change) -> None:
        """Follow an edit of the distance's values in place.

        Surfels of the blocks that depend on the change are extracted anew; what is
        drawn then equals what a new rasterizer draws, to the bit. Raises ValueError
        where a deflection moves the surface.
        """
        if self._cut_rims is not None:
            raise ValueError(
                "a surface moved by a deflection cannot be edited; bend its distance"
            )
        if np.any(change.high < change.low):
            return
        if change.kind in (ChangeKind.FILM, ChangeKind.TINT):
            return
        if self._creases is not None:
            self._creases.update(change)
        blocks = self._blocks
        places = blocks.around(change, self._before)
        if self._before is None:
            self._before = self._distance.values.astype(np.float32)
        pools = self._coarse, self._fine
        near = blocks.number(places)
        places = np.concatenate([places, *(far_blocks(p, change) for p in pools)])
        numbers, first = np.unique(blocks.number(places), return_index=True)
        if len(numbers) == 0:
            return
        places = places[first]
        found = self._extraction.find(self._distance, pools, places, change)
        full = found[0].counts + found[1].counts > 0
        if (source := blocks.occupy(numbers, full)) is not None:
            self._coarse.rearrange(source)
            self._fine.rearrange(source)
        at = np.searchsorted(blocks.numbers, numbers[full])
        for surfels, f in zip(pools, found, strict=True):
            surfels.replace(at, f.counts[full], f.rows[full], f.position, f.normal)
            of = blocks.number(surfels.far[:, :3] >> surfels.shift)
            within = np.minimum(np.searchsorted(numbers, of), len(numbers) - 1)
            kept = surfels.far[numbers[within] != of]
            surfels.far = np.concatenate([kept, f.far])
        if self._lookup is not None:
            self._lookup.update(blocks.numbers, near, numbers)

    def draw(self, camera: Camera, pool: ThreadPool) -> GBuffer:
        """Find the air surface; the bits do not depend on the pool's size.

        Raises ValueError for an orthographic camera, whose rays do not meet.
        """
        if camera.projection is Projection.ORTHOGRAPHIC:
            raise ValueError(
                "a G-buffer of surfels needs an eye point; take an equidistant or "
                "perspective camera"
            )
        height, width = camera.height, camera.width
        # what is alone on its thread goes first: others may still end a picture
        self._rims.begin(pool, height * width)
        listed = self._project(camera, pool)
        # every pixel of these is written by the one tile that holds it
        result = GBuffer(
            np.empty((height, width), np.float32),
            np.empty((height, width, 3), np.float32),
            np.empty((height, width), np.float32),
            np.zeros((height, width), np.uint8),
        )
        table = camera.lens_table()
        rays = self._tile_rays(table)
        down, across = tile_grid(height, width, (TILE_HEIGHT, TILE_WIDTH), MOST_TILES)
        found = np.empty((down * across, 3), np.int64)
        counter = np.zeros(1, np.int64)
        discs = Discs(
            self._buffers.records.reshape(-1),
            self._buffers.boxes,
            self._split,
            self._inverses,
            np.float32(CORE_SIGMAS2 / RADIUS_SIGMAS**2),
            np.float32(BEHIND_MM),
            REFRESH,
        )
        surface = GeometryPlanes(result.depth_mm, result.normal, result.coverage)

        def draw(_: int) -> None:
            draw_tiles(
                counter,
                across,
                discs,
                self._buffers.ranges,
                listed,
                rays,
                self._scratch(listed),
                surface,
                found,
            )

        pool.map(draw, range(pool.threads))
        fragments, hidden, _ = found.sum(axis=0).tolist()
        self.counters["fragments"], self.counters["hidden"] = fragments, hidden
        self.counters["holes filled"] = 0
        torn = [divmod(int(n), across) for n in np.flatnonzero(found[:, 2])]
        if torn or not self._has_filled:
            # the first picture loads the code in any case: no later one waits for it
            self._has_filled = True
            self.counters["holes filled"] = fill_holes(
                table, result, torn or [(0, 0)], pool
            )
        if self._cut_rims is not None:
            # before rims: the grid that those are looked for in is too coarse for what
            # a cut leaves standing
            done = self._rims.done
            traced, corrected = self._cut_rims.trace(camera, pool, result, done)
            self.counters["cut rays traced"] = traced
            self.counters["cut pixels corrected"] = corrected
        if self._sharp:
            traced, moved = self._rims.sharpen(camera, pool, result)
            self.counters["rim rays traced"] = traced
            self.counters["rim pixels moved"] = moved
        if self._creases is not None:
            self.counters["crease pixels"] = self._creases.trace(camera, pool, result)
        return result

    def _project(self, camera: Camera, pool: ThreadPool) -> int:
        near = NEAR_SPACINGS * self._coarse.spacing_mm
        reach = SIGMA_PER_SPACING * RADIUS_SIGMAS
        # coarse discs begin where they still reach under the last fine ones
        coarse_from = near - math.sqrt(CORE_SIGMAS2 / RADIUS_SIGMAS**2) * (
            reach * self._coarse.spacing_mm
        )
        if len(self._buffers.boxes) <= self.splat_count:
            # with some to spare for what edits bring about
            self._buffers = _make_buffers(self.splat_count + self.splat_count // 8)
        # a grid point is up to half a spacing's diagonal from its surfel
        slack = self._coarse.spacing_mm
        allowed = None
        if self._lookup is not None:
            allowed = self._lookup.seen_from(camera.eye_mm)
        blocks = self._blocks.visible(
            camera,
            pool,
            radius_mm=reach * self._coarse.spacing_mm + slack,
            near_reach_mm=near,
            far_from_mm=coarse_from,
            hide=self._hide and allowed is None,
            allowed=allowed,
        )
        listed = kept = self._split = 0
        parts: list[Callable[[], int]] = []
        for surfels, mark, low, high in (
            (self._fine, NEAR, NEAREST_MM, near),
            (self._coarse, FAR, coarse_from, math.inf),
        ):
            self._split = listed
            limits = low, high, reach * surfels.spacing_mm
            runs = self._blocks.runs(blocks, mark, surfels.spans, PART)
            project = self._projection(camera, surfels, runs, limits, listed)
            parts += [partial(project, part) for part in range(len(runs.cuts) - 1)]
            listed += len(runs)
            kept += runs.rows
        # both sets in one: threads are slow to wake
        visible = sum(pool.map(call, parts))
        rows = int(self._coarse.spans.rows.sum() + self._fine.spans.rows.sum())
        self.counters = {
            "listed": listed,
            "visible": visible,
            "rows": rows,
            "culled rows": rows - kept,
            "blocks in view": blocks.in_view,
            "hidden blocks": blocks.hidden,
            "looked up": int(allowed is not None),
        }
        return listed

    def _projection(
        self,
        camera: Camera,
        surfels: SurfelPool,
        runs: Runs,
        limits: tuple[float, float, float],
        base: int,
    ) -> Callable[[int], int]:
        """Return what projects a part of a set's runs; `base` records come before."""
        frame = camera.frame.copy()
        frame[0] -= surfels.first_mm
        frame32 = frame.astype(np.float32)
        lens, buffers = lens_of(camera), self._buffers
        limits32 = DiscLimits(*map(np.float32, (*limits, FACING)))

        def project(part: int) -> int:
            return project_surfels(
                runs.runs,
                runs.cuts[part, 0],
                runs.cuts[part + 1, 0],
                surfels.position,
                surfels.normal,
                frame32,
                lens,
                limits32,
                buffers,
                base + runs.cuts[part, 1],
            )

        return project

    def _tile_rays(self, table: NDArray[np.float32]) -> NDArray[np.float32]:
        """Lay rays out as `tile_by_tile` does, once a lens."""
        if table is not self._table:
            height, width = table.shape[:2]
            down, across = tile_grid(
                height, width, (TILE_HEIGHT, TILE_WIDTH), MOST_TILES
            )
            size = down * across * SQUARES * RAY
            self._rays = lined_up(size).reshape(down * across, SQUARES * RAY)
            self._rays[:] = tile_by_tile(table, down, across)
            self._table = table
        return self._rays

    def _scratch(self, listed: int) -> SurfelScratch:
        scratch: SurfelScratch | None = getattr(self._local, "scratch", None)
        if scratch is None or len(scratch.items) < listed + SQUARE:
            scratch = make_surfel_scratch(len(self._buffers.ranges))
            self._local.scratch = scratch
        return scratch


def _make_buffers(surfels: int) -> SurfelBuffers:
    # one more for lanes that are not wanted
    return SurfelBuffers(
        np.empty((surfels + 1, RECORD), np.float32),
        np.empty((surfels + 1, 4), np.int32),
        np.empty(surfels + SQUARE, np.int32),
    )
