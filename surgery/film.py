"""Blood on the walls of an airway: where it comes from, where it runs, where it went.

It is a thin viscous film (v = rho g t^2 / 3 mu along a slope) on the cells of the
carved surface. It runs in fixed steps of the samples' time, so a replay finds the same
blood whatever the frames do. Volumes are whole units: what was bled is on the surface,
was sucked off or got out, to the last unit. Undoing a cut does not undo the blood.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import ndimage
from xxhash import xxh3_128

from anatomy.hazard_volumes import UNIT_MM as HAZARD_UNIT_MM
from anatomy.hazard_volumes import HazardVolumes
from anatomy.tissue import Label
from renderers.scene import AirSurface, Change, Volume
from renderers.scene.scene import FILM_UNIT_MM, WOUND_UNIT_MM
from surgery.kernels import flow_film as kernels
from surgery.kernels.film_cells import (
    AREA,
    BIN_MM,
    BORDER,
    LINKS,
    NOSTRIL,
    THROAT,
    Cells,
    Ground,
    reshape_cells,
)
from system import UserError

STEPS_PER_S = 30
DRAWN_EVERY = 2
"""Steps between two drawings of the film."""

HOLD_MM = 0.05
"""So much stays on a wall, held by its roughness."""

DROP_MM = 1.5
"""Thickness at which blood drips from what faces down."""

ROUNDS = 4
"""Of levelling in a step."""

UNIT_MM3 = 1e-6

HEAD_UP_DEG = 20.0


def gravity_lying(head_up_deg: float = HEAD_UP_DEG) -> NDArray[np.float64]:
    """Return which way is down for a patient on the back, LPS unit vector ``(3,)``."""
    angle = math.radians(head_up_deg)
    return np.array([0.0, math.cos(angle), -math.sin(angle)])


@dataclass(frozen=True, slots=True)
class BleedingRate:
    """Set how a source bleeds: ``rate / (1 + t / tau)^2``; in all rate times tau.

    rate: mL/min for each cm2 of cut, or mL/min of an artery. tau_s: of clotting.
    """

    rate: float
    tau_s: float


MUCOSA, BONE, SOFT, ARTERY = range(4)
KINDS = ("mucosa", "bone", "soft tissue", "artery")

RATES: tuple[BleedingRate, ...] = (
    BleedingRate(1.0, 200.0),
    BleedingRate(0.15, 300.0),
    BleedingRate(0.5, 200.0),
)
"""By design, so that some 15 cm2 of cut mucosa bleed 50 mL and all of an operation 100
to 300 mL, as sinus operations do."""

ARTERIES: Mapping[str, BleedingRate] = {
    "sphenopalatine artery": BleedingRate(8.0, 240.0),
    "ethmoidal arteries": BleedingRate(5.0, 180.0),
}
"""By the names of `HazardVolumes`. By design: brisk, but not a carotid."""

ARTERY_LABELS = {
    Label.SPHENOPALATINE_ARTERY: "sphenopalatine artery",
    Label.ETHMOIDAL_ARTERY: "ethmoidal arteries",
}

OPENED_MM = 0.3
"""A cut that comes this near to an artery opens it."""

CUT_MM = 0.15
"""The surface is a cut where it lay so deep below the pristine one."""

BLEEDING_SHARE = 0.2
"""Of a cut's cells that bleed, each for as many others: vessels, not all of the flesh.
"""


@dataclass(slots=True)
class FilmLedger:
    """Count blood in units of `UNIT_MM3`; integers, so that nothing gets lost.

    bled: by `KINDS`. sucked. left: unused, by the nostril, by the throat, over the
    grid's border.
    """

    bled: NDArray[np.int64] = field(
        default_factory=lambda: np.zeros(len(KINDS), np.int64)
    )
    sucked: int = 0
    left: NDArray[np.int64] = field(default_factory=lambda: np.zeros(4, np.int64))

    def copy(self) -> "FilmLedger":
        """Return books that no later step touches."""
        return replace(self, bled=self.bled.copy(), left=self.left.copy())

    @property
    def bled_ml(self) -> float:
        """Return all blood that was lost by the vessels, mL."""
        return int(self.bled.sum()) * UNIT_MM3 / 1000

    @property
    def sucked_ml(self) -> float:
        """Return what suction took, mL."""
        return self.sucked * UNIT_MM3 / 1000

    @property
    def left_ml(self) -> float:
        """Return what ran out of the nose, down the throat or off the grid, mL."""
        return int(self.left.sum()) * UNIT_MM3 / 1000


@dataclass(frozen=True, slots=True)
class Suction:
    """Where a tool sucks: tip ``(3,)`` LPS mm, reach in mm, flow in mL/min."""

    tip_mm: NDArray[np.float64]
    reach_mm: float = 2.5
    flow_ml_min: float = 400.0


@dataclass(slots=True)
class _Sources:
    """What bleeds: voxel, kind, first step, units/s and tau, units given."""

    voxel: NDArray[np.int32] = field(default_factory=lambda: np.zeros(0, np.int32))
    kind: NDArray[np.int8] = field(default_factory=lambda: np.zeros(0, np.int8))
    started: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, np.int64))
    rates: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 2)))
    emitted: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, np.int64))

    def copy(self) -> "_Sources":
        copied = replace(self)
        copied.keep(np.ones(len(self.voxel), bool))
        return copied

    def keep(self, rows: NDArray[np.bool_]) -> None:
        for name in ("voxel", "kind", "started", "rates", "emitted"):
            setattr(self, name, getattr(self, name)[rows])

    def add(
        self,
        voxel: NDArray[np.int32],
        kind: NDArray[np.int8],
        step: int,
        rates: NDArray[np.float64],
    ) -> None:
        count = len(voxel)
        self.voxel = np.concatenate([self.voxel, voxel])
        self.kind = np.concatenate([self.kind, kind])
        self.started = np.concatenate([self.started, np.full(count, step, np.int64)])
        self.rates = np.concatenate([self.rates, rates])
        self.emitted = np.concatenate([self.emitted, np.zeros(count, np.int64)])


@dataclass(frozen=True, slots=True)
class FilmState:
    """All blood of one moment: some 200 bytes a wet cell.

    cells: rows in use of each array. clock: the last step, and steps skipped. drawn:
    flat voxels and what was drawn there. reached: box of all that was ever drawn.
    """

    cells: tuple[NDArray[Any], ...]
    sources: _Sources
    books: FilmLedger
    arteries: dict[tuple[str, str], int]
    clock: tuple[int | None, int]
    suction: Suction | None
    drawn: tuple[NDArray[np.int64], NDArray[np.int32]]
    reached: NDArray[np.int64]


class BloodFilm:
    """Let an operated head bleed.

    books: where the blood is. arteries: those opened so far, by name and side. Knows no
    clock: `advance` is told the samples' time.
    """

    def __init__(
        self,
        surface: AirSurface,
        film: NDArray[np.uint8],
        *,
        labels: Volume | None = None,
        hazards: HazardVolumes | None = None,
        gravity: ArrayLike | None = None,
        blood_bias: float = 1.0,
    ) -> None:
        """Begin with a dry head.

        surface: as it is carved; its distance is read in place, and it has wounds.
        film: the array of ``surface.wounds.film``, written in place. labels: of the
        head on the same grid; they say where blood gets out. gravity: ``(3,)`` LPS,
        down; None for a patient on the back, head up. blood_bias: factor on all
        bleeding; .4 is decongested.
        """
        if surface.wounds is None:
            raise UserError("blood needs a surface with wounds")
        if film.shape != surface.distance.shape or film.dtype != np.uint8:
            raise UserError(
                f"film must be uint8 of shape {surface.distance.shape}, got "
                f"{film.dtype} {film.shape}"
            )
        down = np.asarray(gravity_lying() if gravity is None else gravity, np.float64)
        length = float(np.linalg.norm(down))
        if down.shape != (3,) or not (math.isfinite(length) and length > 0):
            raise UserError(f"gravity is a direction of three numbers, got {gravity!r}")
        if not (math.isfinite(blood_bias) and 0 <= blood_bias <= 10):
            raise UserError(f"blood bias must be within 0..10, got {blood_bias}")
        volume = surface.distance
        self.books = FilmLedger()
        self.arteries: dict[tuple[str, str], int] = {}
        self.hold_mm = HOLD_MM
        self._wounds = surface.wounds
        self._volume = volume
        self._hazards = hazards
        self._labels = labels
        self._bias = blood_bias
        self._film = film
        spacing = volume.spacing_mm
        down = volume.direction.T @ down / length
        extent = (np.array(volume.shape[::-1]) - 1) * spacing
        margin = 2 * float(spacing.max())
        heights = -np.minimum(down * extent, 0), -np.maximum(down * extent, 0)
        lowest = float(heights[1].sum()) - margin
        highest = float(heights[0].sum()) + margin
        bins = math.ceil((highest - lowest) / BIN_MM) + 2
        self._heads = np.full(bins, -1, np.int32)
        exits = np.zeros((1, 1, 1), np.uint8)
        if labels is not None:
            exits = np.zeros(256, np.uint8)[labels.values]
            exits[labels.values == Label.OUTSIDE_AIR] = NOSTRIL
            exits[labels.values == Label.NASOPHARYNX_AIR] = THROAT
        self._ground = Ground(volume.values, np.array(spacing), down, lowest, exits)
        # pages of zeros take no memory before they are written to
        self._slot = np.zeros(film.size, np.int32)
        self._spread = np.zeros(film.size, np.int32)
        self._cells = _empty_cells(4096, self._slot)
        self._sources = _Sources()
        self._step: int | None = None
        self._skipped = 0
        self._suction: Suction | None = None
        self._box = _no_box()
        self._reached = _no_box()

    @property
    def wet_cells(self) -> int:
        """Return how many cells blood has reached."""
        return int(self._cells.used[0])

    @property
    def held(self) -> int:
        """Return what lies on the surface, in units of the books."""
        return int(self._cells.volume[: self.wet_cells].sum())

    @property
    def thickness(self) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
        """Return flat voxels of the wet cells, in order, and their thickness in mm."""
        count = self.wet_cells
        order = np.argsort(self._cells.voxel[:count])
        area = self._cells.shape[:count, AREA]
        mm = (self._cells.volume[:count] * UNIT_MM3 / area).astype(np.float32)
        return self._cells.voxel[:count][order], mm[order]

    def after_edit(self, change: Change) -> None:
        """Follow a cut, or a cut undone: move blood, begin and end sources.

        What lay on tissue that is gone goes to the nearest surface, or falls.
        """
        low = np.maximum(change.low - 2, 0)
        high = np.minimum(change.high + 2, np.array(self._volume.shape[::-1]) - 1)
        cells = self._cells
        voxels = self._boxed(cells.voxel[: self.wet_cells], low, high)
        rows = np.flatnonzero(voxels)
        if len(rows):
            # taken away as it was drawn: the axis may change
            was = cells.volume[rows].copy()
            cells.volume[rows] = 0
            self._paint(rows.astype(np.int64), 0)
            cells.volume[rows] = was
            self._make_room()
            cells = self._cells
        lost = reshape_cells(self._ground, cells, low, high)
        self.books.left[BORDER] += lost
        self._close_gaps()
        self._find_sources(low, high)

    def suck(self, suction: Suction | None) -> None:
        """Set where a tool sucks from now on; None where none does."""
        self._suction = suction

    def advance(self, time_s: float) -> None:
        """Let blood run up to a sample's time; the first call sets the beginning.

        Any samples between give the same blood: it runs in steps of 1 / `STEPS_PER_S`.
        """
        if not math.isfinite(time_s):
            raise UserError(f"a sample's time is finite, got {time_s} s")
        last = math.floor(time_s * STEPS_PER_S) - self._skipped
        if self._step is None:
            self._step = last
            return
        for step in range(self._step, last):
            self._run_step(step)
            self._step = step + 1

    def skip(self, time_s: float) -> None:
        """Let no blood run up to a sample's time: the trainer was frozen meanwhile."""
        if self._step is not None:
            last = math.floor(time_s * STEPS_PER_S)
            # bleeding slows down with time: its own clock stands
            self._skipped = max(last - self._step, self._skipped)

    def drawn_box(self) -> tuple[NDArray[np.int64], NDArray[np.int64]] | None:
        """Return the first and last voxel drawn anew since the last call, i j k."""
        box = self._box
        if box[3] < box[0]:
            return None
        top = np.array(self._volume.shape[::-1]) - 1
        self._reached = _joined(self._reached, box)
        self._box = _no_box()
        return np.maximum(box[:3], 0), np.minimum(box[3:], top)

    def checkpoint(self) -> FilmState:
        """Return all that later steps may change."""
        count = self.wet_cells
        reached = _joined(self._reached, self._box)
        drawn = self._drawn_voxels(reached)
        return FilmState(
            tuple(array[:count].copy() for array in _rows(self._cells)),
            self._sources.copy(),
            self.books.copy(),
            dict(self.arteries),
            (self._step, self._skipped),
            self._suction,
            (drawn, self._spread[drawn]),
            reached,
        )

    def restore(self, state: FilmState) -> None:
        """Make the blood what it was; the next `drawn_box` tells where that shows."""
        before = _joined(self._reached, self._box)
        wet = self._drawn_voxels(before)
        film = self._film.reshape(-1)
        self._spread[wet] = 0
        film[wet] = 0
        self._slot[self._cells.voxel[: self.wet_cells]] = 0
        count = len(state.cells[0])
        while len(self._cells.voxel) < 2 * count:
            self._cells = _empty_cells(2 * len(self._cells.voxel), self._slot)
        cells = self._cells
        for array, then in zip(_rows(cells), state.cells, strict=True):
            array[:count] = then
        cells.used[0] = count
        self._slot[cells.voxel[:count]] = np.arange(1, count + 1)
        drawn, spread = state.drawn
        self._spread[drawn] = spread
        film[drawn] = np.minimum(spread >> 4, 255)
        self._sources = state.sources.copy()
        self.books = state.books.copy()
        self.arteries = dict(state.arteries)
        self._step, self._skipped = state.clock
        self._suction = state.suction
        self._box = _joined(before, state.reached)
        self._reached = state.reached.copy()

    def hash(self) -> str:
        """Return 32 hexadecimal digits of the wet cells and the books."""
        count = self.wet_cells
        order = np.argsort(self._cells.voxel[:count])
        digest = xxh3_128(self._cells.voxel[:count][order].tobytes())
        digest.update(self._cells.volume[:count][order].tobytes())
        digest.update(self.books.bled.tobytes())
        digest.update(self.books.left.tobytes())
        digest.update(str(self.books.sucked).encode())
        return digest.hexdigest()

    def _run_step(self, step: int) -> None:
        dt = 1.0 / STEPS_PER_S
        self._make_room()
        sources = self._sources
        if len(sources.voxel):
            before = sources.emitted.copy()
            kernels.bleed(
                self._ground,
                self._cells,
                sources.voxel,
                sources.started,
                sources.rates,
                sources.emitted,
                step,
                dt,
            )
            given = sources.emitted - before
            np.add.at(self.books.bled, sources.kind, given)
        if self.wet_cells:
            kernels.run(
                self._ground,
                self._cells,
                self._heads,
                step,
                dt,
                (self.hold_mm, DROP_MM, ROUNDS),
                self.books.left,
            )
            self._suck(dt)
        if step % DRAWN_EVERY == 0:
            self._paint(np.zeros(0, np.int64), 1)

    def _suck(self, dt: float) -> None:
        suction = self._suction
        if suction is None:
            return
        most = round(_units_per_s(suction.flow_ml_min) * dt)
        matrix = self._volume.voxel_from_world
        tip = matrix[:3, :3] @ suction.tip_mm + matrix[:3, 3]
        tip *= self._volume.spacing_mm
        self.books.sucked += kernels.suck(
            self._cells,
            self._volume.shape,
            self._ground.spacing,
            tip,
            suction.reach_mm,
            most,
        )

    def _paint(self, rows: NDArray[np.int64], least: int) -> None:
        kernels.paint(
            self._cells,
            rows,
            1.0 / FILM_UNIT_MM,
            least,
            self._spread,
            self._film,
            self._box,
        )

    def _drawn_voxels(self, box: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return the flat voxels of a box on which anything is drawn."""
        _, ny, nx = shape = self._volume.shape
        low, high = np.maximum(box[:3], 0), np.maximum(box[3:] + 1, 0)
        here = tuple(slice(low[a], high[a]) for a in (2, 1, 0))
        k, j, i = np.nonzero(self._spread.reshape(shape)[here])
        flat: NDArray[np.int64] = ((k + low[2]) * ny + j + low[1]) * nx + i + low[0]
        return flat

    def _make_room(self) -> None:
        """Keep as many free rows as a step may take, at the least."""
        size = len(self._cells.voxel)
        if 2 * self.wet_cells <= size:
            return
        old, count = self._cells, self.wet_cells
        self._cells = _empty_cells(2 * size, self._slot)
        for array, was in zip(_rows(self._cells), _rows(old), strict=True):
            array[: len(was)] = was
        self._cells.used[0] = count

    def _close_gaps(self) -> None:
        count = self.wet_cells
        kept = np.flatnonzero(self._cells.voxel[:count] >= 0)
        if len(kept) < count:
            self._put_in_order(kept)

    def _put_in_order(self, order: NDArray[np.int64]) -> None:
        """Keep these rows, in this order."""
        cells, count = self._cells, self.wet_cells
        numbers = np.full(count + 1, -1, np.int32)
        numbers[order] = np.arange(len(order))
        for array in _rows(cells):
            array[: len(order)] = array[order]
        cells.used[0] = count = len(order)
        cells.beside[:count] = numbers[cells.beside[:count]]
        self._slot[cells.voxel[:count]] = np.arange(1, count + 1)

    def _boxed(
        self,
        voxels: NDArray[np.int32],
        low: NDArray[np.int64],
        high: NDArray[np.int64],
    ) -> NDArray[np.bool_]:
        """Tell which flat voxels lie within a box."""
        _, ny, nx = self._volume.shape
        places = np.stack([voxels % nx, voxels // nx % ny, voxels // (nx * ny)], axis=1)
        within: NDArray[np.bool_] = np.all((places >= low) & (places <= high), axis=1)
        return within

    def _find_sources(self, low: NDArray[np.int64], high: NDArray[np.int64]) -> None:
        """End the sources of a box that are no cut any more, and begin new ones."""
        here = tuple(slice(low[a], high[a] + 1) for a in (2, 1, 0))
        d = self._volume.values[here]
        depth = self._wounds.pristine.values[here] - d
        tissue = d > 0
        cross = ndimage.generate_binary_structure(3, 1)
        cut = ndimage.binary_dilation(tissue, cross) & ~tissue & (depth > CUT_MM)
        k, j, i = np.nonzero(cut)
        _, ny, nx = self._volume.shape
        voxels = ((k + low[2]) * ny + j + low[1]) * nx + i + low[0]
        sources = self._sources
        inside = self._boxed(sources.voxel, low, high) & (sources.kind != ARTERY)
        sources.keep(~inside | np.isin(sources.voxel, voxels))
        bleeds = _scatter(voxels) < BLEEDING_SHARE
        bleeds &= ~np.isin(voxels, sources.voxel)
        places = k[bleeds], j[bleeds], i[bleeds]
        kind = self._kinds(here, depth[places], places)
        spacing = self._volume.spacing_mm
        face = float(np.prod(spacing)) ** (2 / 3)
        rate = np.array([_units_per_s(r.rate) for r in RATES]) / 100.0
        tau = np.array([r.tau_s for r in RATES])
        # a cell's mean area, from how a ball's surface falls on the axes
        area = 1.2 * face / BLEEDING_SHARE * self._bias
        rates = np.stack([rate[kind] * area, tau[kind]], axis=1)
        step = self._step or 0
        sources.add(voxels[bleeds].astype(np.int32), kind.astype(np.int8), step, rates)
        for name, near in self._artery_gaps(here, d).items():
            gaps = near[cut]
            if len(gaps):
                self._open_artery(name, gaps, voxels)

    def _kinds(
        self,
        here: tuple[slice, ...],
        depth: NDArray[np.float32],
        places: tuple[NDArray[np.int64], ...],
    ) -> NDArray[np.int64]:
        """Return what is laid open at depths below the pristine surface."""
        wounds = self._wounds
        flesh = wounds.flesh.values[here][places].astype(np.float32)
        bone = wounds.bone.values[here][places] * np.float32(WOUND_UNIT_MM)
        deep = wounds.deep.values[here][places]
        covered = np.where(flesh == 255, np.inf, flesh * np.float32(WOUND_UNIT_MM))
        beyond = np.where(deep > 127, BONE, SOFT)
        found = np.where(depth < covered + bone, BONE, beyond)
        return np.where(depth < covered, MUCOSA, found)

    def _artery_gaps(
        self, here: tuple[slice, ...], d: NDArray[np.float32]
    ) -> dict[str, NDArray[np.float32]]:
        """Return how far each artery lies from the surface in a box, mm."""
        found: dict[str, NDArray[np.float32]] = {}
        if self._hazards is not None:
            for name, volume in self._hazards.volumes.items():
                if name in ARTERIES and volume.shape == self._volume.shape:
                    values = volume.values[here].astype(np.float32)
                    found[name] = values * np.float32(HAZARD_UNIT_MM) + np.minimum(d, 0)
        elif self._labels is not None:
            labels = self._labels.values[here]
            for label, name in ARTERY_LABELS.items():
                if np.any(labels == label):
                    found[name] = ndimage.distance_transform_edt(
                        labels != label, self._volume.spacing_mm[::-1]
                    ).astype(np.float32) + np.minimum(d, 0)
        return found

    def _open_artery(
        self, name: str, gaps: NDArray[np.float32], voxels: NDArray[np.int64]
    ) -> None:
        """Open an artery where a cut is nearest to it, or let it bleed on."""
        best = int(np.lexsort((voxels, gaps))[0])
        if gaps[best] > OPENED_MM:
            return
        voxel = int(voxels[best])
        _, ny, nx = self._volume.shape
        place = np.array([voxel % nx, voxel // nx % ny, voxel // (nx * ny)], np.float64)
        matrix = self._volume.world_from_voxel
        x = float(matrix[0, :3] @ place + matrix[0, 3])
        key = name, "left" if x > 0 else "right"
        known = self.arteries.get(key)
        sources = self._sources
        if known is not None:
            row = np.flatnonzero((sources.kind == ARTERY) & (sources.voxel == known))
            sources.voxel[row] = voxel
        else:
            rate = ARTERIES[name]
            rates = np.array([[_units_per_s(rate.rate) * self._bias, rate.tau_s]])
            kind = np.array([ARTERY], np.int8)
            sources.add(np.array([voxel], np.int32), kind, self._step or 0, rates)
        self.arteries[key] = voxel


def _units_per_s(ml_min: float) -> float:
    return ml_min * 1000 / 60 / UNIT_MM3


def _scatter(voxels: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return a number in 0..1 for each voxel, always the same."""
    h = voxels.astype(np.uint64) * np.uint64(0x9E3779B97F4A7C15)
    h ^= h >> np.uint64(31)
    h *= np.uint64(0xBF58476D1CE4E5B9)
    h ^= h >> np.uint64(29)
    return (h >> np.uint64(11)).astype(np.float64) / float(1 << 53)


def _no_box() -> NDArray[np.int64]:
    return np.array([1 << 30] * 3 + [-1] * 3, np.int64)


def _joined(a: NDArray[np.int64], b: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the box around two, each first and last voxel."""
    low, high = np.minimum(a[:3], b[:3]), np.maximum(a[3:], b[3:])
    return np.concatenate([low, high])


def _rows(cells: Cells) -> list[NDArray[Any]]:
    """Return the arrays that have a row for each cell."""
    return [a for a in cells if a is not cells.slot and a is not cells.used]


def _empty_cells(size: int, slot: NDArray[np.int32]) -> Cells:
    return Cells(
        np.zeros(1, np.int64),
        slot,
        np.zeros(size, np.int32),
        np.zeros(size, np.int64),
        np.zeros(size, np.int64),
        np.zeros(size, np.int64),
        np.zeros((size, 6), np.float32),
        np.zeros((size, 4), np.uint8),
        np.zeros((size, LINKS), np.int32),
        np.full((size, LINKS), -1, np.int32),
        np.zeros((size, LINKS, 2), np.float32),
        np.zeros(size, np.int32),
        np.zeros(size, np.int32),
        np.zeros(size, np.int32),
        np.zeros(size, np.int64),
        np.zeros(size, np.float64),
        np.zeros(size, np.float64),
    )
