"""Estimate what steps of a length leave out of pictures of a scene; choose the step.

An integrated segment takes the density between its two ends for a straight line. It is
none: the interpolant bends within a cube of voxels and has kinks between them. A step
of a voxel serves for walls and leaves four times the error where bone is seen through
tissue. The error falls with the square of the step, in colour and in opacity, lit or
not, so that it is extrapolated from lines cast through the scene in steps of a voxel, a
half and a quarter. Where the transfer function shows a shell far thinner than a voxel
it falls more slowly until steps are shorter than the shell; finer lines are cast there.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from renderers.art.classification import (
    classification,
    clear_intervals,
    sums_at_nodes,
)
from renderers.art.crew import ALONE, Crew
from renderers.art.kernels.composite_lines import LineArrays, composite_lines
from renderers.art.quality import Quality
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

RUNGS = tuple(2 ** (-k / 4) for k in range(17))
"""Of a quality's step, the largest first. A shell of a tenth of a voxel needs an eighth
to a tenth."""

STEEPLY = 1.25
"""Order of what is left from which on it is taken to go on falling with the square."""

FINEST = 1 / 64
"""Step of lines, in voxels."""

NOTHING = 1e-9
"""Error of finer lines that is none: far below what rounding leaves."""

_CHANGING = 4
"""Of so many lines the one that changed most goes on to steps below an eighth."""

_FALL = 8
"""What the others changed by then, squared, is taken to fall by, less than it does."""

_TOGETHER = 64
"""Lines that one thread casts in one go."""

_DRAWS = 8
"""Places drawn for one that is clear."""


@dataclass(frozen=True, slots=True)
class StepErrors:
    """What steps of a voxel and of half a voxel leave out.

    Each an error: root mean square over lines that show something, of premultiplied
    linear colour and opacity. Half of the lines cross the whole scene, half begin in
    it, where it is clear and an eye may be. finer: of a quarter, an eighth and on, as
    far as need be.
    """

    whole: float
    half: float
    finer: tuple[float, ...] = ()

    @classmethod
    def of(cls, scene: Scene, tolerance: float = 1.0) -> "StepErrors":
        """Cast lines through a scene, the same for each scene of a size.

        tolerance: where what is left falls too slowly to be extrapolated, finer lines
            are cast until they leave no more than this.
        """
        return cls._by(_Caster(scene), tolerance)

    @classmethod
    def _by(cls, cast: "_Caster", tolerance: float) -> "StepErrors":
        whole, half, light = (cast(step) for step in (1.0, 0.5, 0.25))
        shown = light[:, 3] > 0
        if np.count_nonzero(shown) < FEWEST:
            return cls(0.0, 0.0)
        # of second order: of the half, a quarter is left in the finest
        left = _rms((half - light)[shown]) * 4 / 3
        errors = cls(_rms((whole - light)[shown]), left)
        step, lines = 0.125, np.flatnonzero(shown)
        fewer = max(len(lines) // _CHANGING, FEWEST)
        change = np.zeros(len(light))
        while step >= FINEST and errors.falls_slowly and errors.least > tolerance:
            finer = cast(step, lines)
            change /= _FALL
            change[lines] = np.mean((finer - light[lines]) ** 2, axis=1)
            left = 4 / 3 * math.sqrt(float(np.mean(change[shown])))
            left = min(left, errors.least)
            errors = replace(errors, finer=(*errors.finer, left))
            light[lines] = finer
            # the same ones from now on
            if len(lines) > fewer:
                lines = np.argsort(-change, kind="stable")[:fewer]
            step /= 2
        return errors

    @property
    def least(self) -> float:
        """Return the error of the shortest steps that were tried."""
        return self.finer[-1] if self.finer else self.half

    @property
    def falls_slowly(self) -> bool:
        """Return whether the last halving took off less than is to be expected."""
        before, last = (self.whole, self.half, *self.finer)[-2:]
        return last > NOTHING and before < 2**STEEPLY * last

    def error(self, step_voxels: float) -> float:
        """Return the error that steps of a length leave."""
        if self.whole <= 0 or self.half <= 0:
            return max(self.whole, self.half)
        known = self.whole, self.half, *self.finer
        halvings = -math.log2(step_voxels)
        k = min(max(math.floor(halvings), 0), len(known) - 2)
        if known[k + 1] < NOTHING:
            return 0.0 if halvings > k else known[k]
        order = math.log2(known[k] / known[k + 1])
        if halvings > len(known) - 1:
            order = min(max(order, 1.0), 2.0)
        return float(known[k + 1] * 2 ** (order * (k + 1 - halvings)))

    def step(self, quality: Quality) -> float:
        """Return the longest step that leaves no more than a quality tolerates.

        In voxels. The shortest of `RUNGS` where even that leaves more.
        """
        steps = [quality.step_voxels * rung for rung in RUNGS]
        if quality.tolerance is None:
            return steps[0]
        enough = (step for step in steps if self.error(step) <= quality.tolerance)
        return next(enough, steps[-1])


class StepEstimate:
    """Estimate the step of a scene, and again when the scene was edited.

    The same on each machine that draws a part of the picture, and for each view.
    quality: the one given, with the step that it takes in the scene and no tolerance.
    """

    def __init__(self, scene: Scene, quality: Quality, crew: Crew = ALONE) -> None:
        self._wanted = quality
        self._cast: _Caster | None = None
        self.quality = replace(quality, tolerance=None)
        if quality.tolerance is not None and quality.classification == "integrated":
            self._cast = _Caster(scene, crew)
            self._estimate(self._cast, quality.tolerance)

    def follow(
        self, scene: Scene, low: NDArray[np.int64], high: NDArray[np.int64]
    ) -> Quality:
        """Estimate anew for a scene edited in a box; return `quality`.

        low, high: its first and last voxel, (k, j, i). Only lines that pass there are
        cast again, to the bits of an estimate that knows nothing from before.
        """
        tolerance = self._wanted.tolerance
        if self._cast is not None and tolerance is not None:
            self._cast.follow(scene, low, high)
            self._estimate(self._cast, tolerance)
        return self.quality

    def _estimate(self, cast: "_Caster", tolerance: float) -> None:
        step = StepErrors._by(cast, tolerance).step(self._wanted)
        self.quality = replace(self._wanted, step_voxels=step, tolerance=None)


def _rms(difference: NDArray[np.float64]) -> float:
    return math.sqrt(float(np.mean(difference**2)))


class _Caster:
    """Composite lines through a scene: (n, 4) premultiplied colour and opacity.

    What was cast is kept for each step, with which lines it is known of.
    """

    def __init__(self, scene: Scene, crew: Crew = ALONE) -> None:
        """Take a scene; crew: shares out the lines."""
        transfer, volume = scene.transfer_function, scene.volume
        self._crew = crew
        self._table = classification(transfer)
        self._sums = sums_at_nodes(self._table)
        self._unit_mm = float(volume.spacing_mm.min())
        self._clear = clear_intervals(transfer)
        self._values = _readable(volume)
        self._lines = _lines(volume, self._clear)
        self._known: dict[float, tuple[NDArray[np.float64], NDArray[np.bool_]]] = {}

    def __call__(
        self, step_voxels: float, chosen: NDArray[np.intp] | None = None
    ) -> NDArray[np.float64]:
        """Cast all lines, or those of some numbers, in steps of so many voxels."""
        count = len(self._lines.start)
        if step_voxels not in self._known:
            room = self._crew.empty((count, 4), np.float64)
            self._known[step_voxels] = room, np.zeros(count, np.bool_)
        light, known = self._known[step_voxels]
        if chosen is None:
            chosen = np.arange(count)
        unknown = chosen[~known[chosen]]

        def cast(first: int) -> None:
            part = unknown[first : first + _TOGETHER]
            found = np.zeros((len(part), 4))
            composite_lines(
                self._values, LineArrays(*(array[part] for array in self._lines)),
                step_voxels * self._unit_mm, CUTOFF, self._table, self._sums, found,
            )  # fmt: skip
            light[part] = found

        if len(unknown):
            self._crew.share(cast, range(0, len(unknown), _TOGETHER))
            known[unknown] = True
        return light[chosen]

    def follow(
        self, scene: Scene, low: NDArray[np.int64], high: NDArray[np.int64]
    ) -> None:
        """Forget the lines that pass a box of edited voxels, or run elsewhere now."""
        self._values = _readable(scene.volume)
        before, self._lines = self._lines, _lines(scene.volume, self._clear)
        if len(before.start) != len(self._lines.start):
            self._known.clear()
            return
        other = np.zeros(len(before.start), np.bool_)
        for old, new in zip(before, self._lines, strict=True):
            other |= (old != new).reshape(len(new), -1).any(axis=1)
        # what lies up to a voxel beside has to do with a voxel
        with np.errstate(divide="ignore", invalid="ignore"):
            near = (low[::-1] - 1.01 - before.start) / before.way
            far = (high[::-1] + 1.01 - before.start) / before.way
        ends = np.stack([near, far])
        begin = np.maximum(ends.min(axis=0).max(axis=1), 0)
        other |= ~(begin > np.minimum(ends.max(axis=0).min(axis=1), before.length_mm))
        for _, known in self._known.values():
            known[other] = False


def _readable(volume: Volume) -> NDArray[np.generic]:
    values = volume.values
    if not values.dtype.isnative or values.dtype == np.float16:
        values = values.astype(np.float32)
    return values


def _lines(volume: Volume, clear: NDArray[np.float32]) -> LineArrays:
    """Draw lines at random, half of them from where the scene is clear.

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
    length = ends.max(axis=0).min(axis=1) - near
    return LineArrays(begin + near[:, None] * way, way, length)
