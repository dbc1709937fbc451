"""What a volume's values say to a march: where something is to be seen, and where not.

After an edit only what lies about the edited voxels is looked at again; all is then as
if the whole volume had been, to the bit.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderers.art.cells.bricks import MOST_VOXELS
from renderers.art.cells.cell_size import QUICK_SIDE, side_for
from renderers.art.cells.cells import CellGrid, cube_distances, follow_distances
from renderers.art.cells.memory_budget import MemoryBudget, budget_for
from renderers.art.crew import ALONE, Crew
from renderers.art.kernels.build_bricks import SHORT
from renderers.art.march import ClassicMarch, March, ScopeMarch
from renderers.art.quality import Quality
from renderers.art.step_estimation import StepEstimate
from renderers.scene import Scene, Volume
from renderers.scene.deflection import Deflection
from system import UserError

LARGEST_LEAP = 1 << 28
"""Voxels of the largest volume for which each cube's distance is kept, one byte each.
Beyond it rays step through empty cells, all of which are the same brick."""


@dataclass(frozen=True, slots=True)
class LookSettings:
    """What a look is taken with; see `renderers.art.ranks.prepare.make_node`."""

    mode: str
    quality: Quality
    packet: int | None = None
    deflection: Deflection | None = None

    def volume(self, scene: Scene) -> Volume:
        """Return the volume that the mode draws; ValueError where there is none."""
        if self.mode not in ("classic", "scope"):
            raise ValueError(f"mode must be classic or scope, got {self.mode!r}")
        if self.mode == "classic":
            return scene.volume
        if scene.surface is None:
            raise ValueError("the scene has no air surface; mode scope needs one")
        return scene.surface.distance

    def march(
        self, scene: Scene, quality: Quality, value_range: tuple[float, float]
    ) -> March:
        """Return the march; quality: with its step, value_range: of the volume."""
        if self.mode == "scope":
            return ScopeMarch(scene, quality, self.packet, self.deflection)
        return ClassicMarch(scene, quality, value_range, self.packet, self.deflection)


@dataclass(slots=True)
class SceneLook:
    """The march of a scene and which cells it meets.

    ranges: float32 ``(cells, 2)``, each cell's smallest and largest value. clear:
    intervals of values that cannot be seen, as cells go by them, and leaps where
    `leaps`. seen: ``(cells,)``. leap: as `cube_distances` has it. span: as `Bricks`
    takes it. empty_value: one that cannot be seen, if any cell is empty.
    """

    settings: LookSettings
    estimate: StepEstimate | None
    march: March
    grid: CellGrid
    ranges: NDArray[np.float32]
    clear: NDArray[np.float32]
    leaps: bool
    seen: NDArray[np.bool_]
    leap: NDArray[np.uint8]
    span: float | None
    empty_value: float

    @classmethod
    def of(
        cls,
        scene: Scene,
        settings: LookSettings,
        cell_side: int | None,
        crew: Crew = ALONE,
    ) -> "SceneLook":
        """Look by cells of a side; None for the quickest that keep it small.

        crew: shares out the parts of the volume.
        """
        volume = settings.volume(scene)
        estimate, quality = None, settings.quality
        if settings.mode == "classic":
            estimate = StepEstimate(scene, quality, crew)
            quality = estimate.quality
        side = QUICK_SIDE if cell_side is None else cell_side
        look = cls._at(scene, volume, settings, estimate, quality, side, crew)
        if cell_side is None and look.march.needs_gradients:
            side = side_for(look.grid.shape, int(np.count_nonzero(look.seen)))
            if side != look.grid.side:
                look = cls._at(scene, volume, settings, estimate, quality, side, crew)
        return look

    @classmethod
    def _at(
        cls,
        scene: Scene,
        volume: Volume,
        settings: LookSettings,
        estimate: StepEstimate | None,
        quality: Quality,
        cell_side: int,
        crew: Crew,
    ) -> "SceneLook":
        grid = CellGrid(volume.shape, cell_side)
        ranges = grid.value_ranges(volume.values, crew)
        low, high = _range_of(ranges)
        march = settings.march(scene, quality, (low, high))
        clear = march.clear if quality.skip_empty else np.zeros((0, 2), np.float32)
        is_large = volume.values.size > LARGEST_LEAP
        # see `ClassicMarch`; and all empty cells of a large volume are one brick
        if march.margin > 1 or (march.margin and is_large):
            clear = grid.clearest(ranges, clear)
        distances = clear[:0] if is_large else clear
        leap = cube_distances(volume.values, distances, crew)
        leaps = len(distances) > 0
        seen = grid.occupied(ranges, clear)
        if march.margin and leaps:
            seen = grid.with_cubes(_cubes(leap, volume.shape) <= march.margin)
        elif march.margin:
            seen = grid.beside(seen)
        empty = ranges[~seen, 0]
        return cls(
            settings,
            estimate,
            march,
            grid,
            ranges,
            clear,
            leaps,
            seen,
            leap,
            _span_of(volume, quality, low, high),
            float(empty[0]) if len(empty) else 0,
        )

    @property
    def shows_empty(self) -> bool:
        """Return whether rays step through empty cells, since there are no leaps."""
        return not self.leap.any() and not self.seen.all()

    def brick_bytes(self, *, raw: bool = False) -> int:
        """Return the memory of a cell; raw: with its values, to be handed on."""
        number = 4 if self.span is None else 2
        channels = 4 if self.march.needs_gradients else 1
        side = self.grid.side
        return number * (channels * (side + 1) ** 3 + raw * (side + 3) ** 3)

    def budget(self, limit: int, *, raw: bool = False) -> MemoryBudget:
        """Fit what one rank draws with into so many bytes; ValueError if it cannot.

        raw: values of cells are kept beside their bricks, to be handed on.
        """
        march, voxels = self.march, math.prod(self.grid.shape)
        number = 4 if self.span is None else 2
        wanted = march.seeks_values and voxels < MOST_VOXELS
        return budget_for(
            self.grid.shape,
            int(np.count_nonzero(self.seen)),
            self.brick_bytes(raw=raw),
            voxels * number if wanted else 0,
            limit,
            bricks=march.needs_gradients,
        )

    def fits(self, limit: int, *, whole: bool = False) -> bool:
        """Return whether all that can be seen fits, `whole` with the volume's copy."""
        try:
            budget = self.budget(limit)
        except UserError:
            return False
        return budget.whole if whole else budget.cells is None

    def follow(
        self, scene: Scene, low: NDArray[np.int64], high: NDArray[np.int64]
    ) -> bool:
        """Look again at what was edited; False, and nothing is done, if it cannot be.

        scene: the same but for the values of voxels in a box. low, high: its first and
        last voxel, (k, j, i). What compact bricks go by, the range of all values, must
        stay what it was, and the march must take as much of what is clear along.
        """
        settings, grid = self.settings, self.grid
        volume, quality = settings.volume(scene), settings.quality
        ranges = grid.new_ranges(self.ranges, volume.values, low, high)
        least, most = _range_of(ranges)
        if self.estimate is not None:
            quality = self.estimate.follow(scene, low, high)
        march = settings.march(scene, quality, (least, most))
        span = _span_of(volume, quality, least, most)
        if span != self.span or march.margin != self.march.margin:
            return False
        self.march, self.ranges = march, ranges
        seen = grid.occupied(ranges, self.clear)
        if self.leaps:
            met = follow_distances(self.leap, volume.values, self.clear, low, high)
            if march.margin:
                near = _cubes(self.leap, volume.shape)
                seen = self.seen.copy()
                if met is not None:
                    grid.mark_cubes(seen, near, march.margin, *met)
        elif march.margin:
            seen = grid.beside(seen)
        self.seen = seen
        return True


def _cubes(leap: NDArray[np.uint8], shape: tuple[int, ...]) -> NDArray[np.uint8]:
    return leap[:-3].reshape([n - 1 for n in shape])


def _range_of(ranges: NDArray[np.float32]) -> tuple[float, float]:
    return float(ranges[:, 0].min()), float(ranges[:, 1].max())


def _span_of(volume: Volume, quality: Quality, low: float, high: float) -> float | None:
    whole = volume.values.dtype.kind in "iu" and max(-low, high) <= SHORT
    return high - low if whole and quality.compact else None
