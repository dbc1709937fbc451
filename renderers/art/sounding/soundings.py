"""What steps of a length leave out of pictures of a scene, and the step that will do.

A segment takes the density between its two ends for a straight line. It is not: the
interpolant bends within a cube of voxels and has kinks between them, the more the
coarser the grid is beside what it shows, and a steep transfer function makes much of
it. So a step of one voxel, which serves for walls, leaves four times the error where
bone is seen through tissue. What it leaves falls with the square of the step, in
colour and in opacity, with lights and without (suite `art-classification`), so that it
can be foretold: from lines cast through the scene, in steps of a voxel, of a half and
of a quarter.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from renderers.art.classification import classification, clear_intervals
from renderers.art.integrated.march import sums_at_nodes
from renderers.art.quality import Quality
from renderers.art.sounding.kernels import composite_lines
from renderers.scene import Scene, Volume

LINES = 512
"""Of either kind. The root mean square of as many differs by a tenth from that of four
times as many."""

MOST_VOXELS = 1 << 21
"""Along all lines. Through grids so long, or so uneven, there are fewer lines."""

CUTOFF = 1e-4
"""Lines end where less is left."""

FEWEST = 16
"""Lines that show something, for their error to count."""

RUNGS = tuple(2 ** (-k / 4) for k in range(9))
"""Of a quality's step, the largest first. No mode takes more than four times the
samples that it is known for."""

_DRAWS = 8
"""Places drawn for one that is clear."""


@dataclass(frozen=True, slots=True)
class Soundings:
    """Hold what steps of a voxel and of half a voxel leave out.

    Each an error: root mean square over lines that show something, of premultiplied
    linear colour and opacity. Half of the lines cross the whole scene, half begin in
    it, where it is clear and an eye may be.
    """

    whole: float
    half: float

    @classmethod
    def of(cls, scene: Scene) -> "Soundings":
        """Cast lines through a scene, the same for each scene of a size."""
        transfer = scene.transfer_function
        table = classification(transfer)
        sums = sums_at_nodes(table)
        volume = scene.volume
        unit_mm = float(volume.spacing_mm.min())
        values = volume.values
        if not values.dtype.isnative or values.dtype == np.float16:
            values = values.astype(np.float32)
        lines = _lines(volume, clear_intervals(transfer))
        found = []
        for step in (1.0, 0.5, 0.25):
            light = np.zeros((len(lines[0]), 4))
            composite_lines(values, *lines, step * unit_mm, CUTOFF, table, sums, light)
            found.append(light)
        finest = found.pop()
        shown = finest[:, 3] > 0
        if np.count_nonzero(shown) < FEWEST:
            return cls(0.0, 0.0)
        whole, half = (
            math.sqrt(float(np.mean((light - finest)[shown] ** 2))) for light in found
        )
        # of second order: of the half, a quarter is left in the finest
        return cls(whole, half * 4 / 3)

    def error(self, step_voxels: float) -> float:
        """Foretell what steps of a length leave."""
        if self.whole <= 0 or self.half <= 0:
            return max(self.whole, self.half)
        order = math.log2(self.whole / self.half)
        if step_voxels < 0.5:
            order = min(max(order, 1.0), 2.0)
        return float(self.half * (2 * step_voxels) ** order)

    def step(self, quality: Quality) -> float:
        """Give the longest step that leaves no more than a quality aims at.

        In voxels. A quarter of the quality's own where even that leaves more.
        """
        steps = [quality.step_voxels * rung for rung in RUNGS]
        if quality.aim is None:
            return steps[0]
        enough = (step for step in steps if self.error(step) <= quality.aim)
        return next(enough, steps[-1])


def settled(scene: Scene, quality: Quality) -> Quality:
    """Give a quality the step that it takes in a scene, and no aim.

    The same on each machine that draws a part of the picture, and for each view.
    """
    if quality.aim is None or quality.classification != "integrated":
        return replace(quality, aim=None)
    return replace(quality, step_voxels=Soundings.of(scene).step(quality), aim=None)


Lines = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]


def _lines(volume: Volume, clear: NDArray[np.float32]) -> Lines:
    """Draw lines, as `composite_lines` takes them.

    Sums, products and roots only, which no two processors round differently.
    """
    drawn = np.random.default_rng(1995)
    top = np.array(volume.shape[::-1], np.float64) - 1
    most = np.linalg.norm(top * volume.spacing_mm) / volume.spacing_mm.min()
    lines = min(LINES, int(MOST_VOXELS / (2 * most)))
    through = drawn.random((lines, 3)) * top
    within = drawn.random((lines * _DRAWS, 3)) * top
    x, y, z = (within + 0.5).astype(np.intp).T
    here = volume.values[z, y, x].astype(np.float64)
    is_clear = np.zeros(len(within), np.bool_)
    for low, high in clear:
        is_clear |= (here >= low) & (here <= high)
    within = within[is_clear][:lines]
    begin = np.concatenate([through, within])
    apart = drawn.random(begin.shape) * top - begin
    x_mm, y_mm, z_mm = ((apart * volume.spacing_mm) ** 2).T
    way = apart / np.sqrt(x_mm + y_mm + z_mm)[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        ends = np.stack([-begin / way, (top - begin) / way])
    near = ends.min(axis=0).max(axis=1)
    near[len(through) :] = 0
    return begin + near[:, None] * way, way, ends.max(axis=0).min(axis=1) - near
