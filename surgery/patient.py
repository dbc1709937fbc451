"""A patient whose tissue can be taken away.

The truth is the signed distance to the air, carved by ``d := min(d, tool)``, beside
pristine fields that never change. It never drifts: cutting the same place again takes
nothing, and the same cut in one step or in a thousand leaves the same patient.
"""

from collections import deque
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from xxhash import xxh3_128

from anatomy.tissue import TISSUE_OF, Label
from anatomy.wall_layers import NO_WALL, WallKind, WallLayers
from renderers.scene import AirSurface, Change, Volume, Wounds
from renderers.scene.scene import WOUND_UNIT_MM
from renderers.scene.volume import AIR_HU
from surgery import solids as solid
from surgery.edit import CuttingLimits, Edit
from surgery.kernels.carve import FULL, carve, clear_pieces, fill_all, share_out
from system import UserError

REACH_MM = 3.0
"""So far from a cut the distance is brought up to date; deeper in tissue nobody asks
how far it is to the air. Loose pieces are looked for within it, too."""

UNDO_BYTES = 64 << 20
"""Old values kept to undo cuts with, at most: some thousand bites."""

FIRST_BONE, LAST_BONE = Label.THICK_BONE, Label.TEETH
SHARED = 2
"""Voxels around one that say how its tissue is shared out, at most."""

UNBREAKABLE_N_MM = 10.0
"""Stiffness of tissue that no hand tool bites."""

_PER_UNIT = 1.0 / WOUND_UNIT_MM


@dataclass(slots=True)
class VolumeLedger:
    """Count what was taken, in shares of a voxel: `FULL` of them are one.

    by_label: ``(256,)`` int64, by the tissue's `Label`. by_wall: ``(256,)`` int64, of
    that the bone of walls, by rows of `WallLayers.kinds`. pieces: of that what had
    become loose. voxel_mm3: volume of a voxel.
    """

    voxel_mm3: float
    by_label: NDArray[np.int64] = field(default_factory=lambda: np.zeros(256, np.int64))
    by_wall: NDArray[np.int64] = field(default_factory=lambda: np.zeros(256, np.int64))
    pieces: int = 0

    @property
    def counts(self) -> int:
        """Return all that was taken."""
        return int(self.by_label.sum())

    def mm3(self, counts: int) -> float:
        """Return the volume of so many counts."""
        return counts / FULL * self.voxel_mm3

    def tissues(self) -> dict[str, float]:
        """Return the volume of each tissue taken, mm3."""
        return {
            Label(int(n)).name.lower().replace("_", " "): self.mm3(
                int(self.by_label[n])
            )
            for n in np.flatnonzero(self.by_label)
        }

    def walls(self, kinds: tuple[WallKind, ...]) -> dict[str, float]:
        """Return the volume of the bone of each wall taken, mm3, by its name."""
        found: dict[str, float] = {}
        for n in np.flatnonzero(self.by_wall):
            name = kinds[n].name or "bone"
            found[name] = found.get(name, 0.0) + self.mm3(int(self.by_wall[n]))
        return found

    def copy(self) -> "VolumeLedger":
        """Return books that no later edit touches."""
        return replace(self, by_label=self.by_label.copy(), by_wall=self.by_wall.copy())

    def add(self, other: "VolumeLedger", sign: int = 1) -> None:
        """Add what others count, or take it away again."""
        self.by_label += sign * other.by_label
        self.by_wall += sign * other.by_wall
        self.pieces += sign * other.pieces


@dataclass(frozen=True, slots=True)
class _Before:
    """What an edit replaced, flat: voxel numbers, distances, three fills."""

    edit: Edit
    books: VolumeLedger
    voxels: NDArray[np.int32]
    distance: NDArray[np.float32]
    fills: tuple[NDArray[np.uint16], ...]

    @property
    def bytes(self) -> int:
        return 14 * len(self.voxels) + 4096 + self.edit.solids.nbytes


@dataclass(frozen=True, slots=True)
class PatientState:
    """What differs from the pristine head at one moment: 18 bytes a voxel.

    voxels: flat numbers. distance, fills: there. books, undo, edits, touched: see
    `OperatedPatient`; what can be undone is shared with the patient.
    """

    voxels: NDArray[np.int64]
    distance: NDArray[np.float32]
    fills: tuple[NDArray[np.uint16], ...]
    books: VolumeLedger
    undo: tuple[_Before, ...]
    edits: int
    touched: tuple[NDArray[np.int64], NDArray[np.int64]] | None


class OperatedPatient:
    """A head that is operated on.

    surface: the air surface as it is now; its distance is edited in place, and its
        wounds say what a cut lays open. pristine: the surface as it was.
    fill: ``(nz, ny, nx)`` uint16, share of tissue in each voxel, `FULL` is all.
    ct: CT numbers that follow the cuts, in place; None where none were given.
    generation: counts changes, undoing included. books: what was taken so far.
    """

    def __init__(
        self,
        surface: AirSurface,
        layers: WallLayers | None,
        labels: Volume | None = None,
        ct: Volume | None = None,
    ) -> None:
        """Copy what will change.

        layers: None for a head whose walls are unknown: all is soft tissue, of the
        labels, where there are any. ct: shows what is taken as air.
        """
        distance = surface.distance
        if layers is None:
            layers = _soft_walls(distance, labels)
        if layers.wall.shape != distance.shape or layers.ground.shape != distance.shape:
            raise UserError(
                f"walls of shape {layers.wall.shape} do not fit a head of "
                f"{distance.shape}"
            )
        self.pristine = surface
        self.layers = layers
        self.generation = 0
        self.edits = 0
        self._distance = distance.values.copy()
        carved = distance.with_values(self._distance, distance.background)
        self.wounds_film: NDArray[np.uint8] = np.zeros(distance.shape, np.uint8)
        self.wounds_pale: NDArray[np.uint8] = np.zeros(distance.shape, np.uint8)
        wounds = _wounds(distance, layers, self.wounds_film, self.wounds_pale)
        self.surface = AirSurface(carved, surface.blood, surface.skin, wounds)
        self.fill = np.empty(distance.shape, np.uint16)
        self._spacing = float(distance.spacing_mm.max())
        flesh, bone = np.empty_like(self.fill), np.empty_like(self.fill)
        self._thickness = layers.table()
        self._fills = self.fill, flesh, bone
        self._fill_up(distance.values, layers.wall.values, self._fills)
        self.books = VolumeLedger(float(np.prod(distance.spacing_mm)))
        self.ct = None
        if ct is not None:
            self._ct = ct.values.copy()
            self._first_ct = ct.values
            self.ct = ct.with_values(self._ct, ct.background)
        self.touched: tuple[NDArray[np.int64], NDArray[np.int64]] | None = None
        matrix = distance.world_from_voxel
        self._grid = np.stack(
            [matrix[:3, 3], *matrix[:3, :3].T, distance.spacing_mm]
        ).astype(np.float64)
        self._walls = layers.wall.values, layers.ground.values
        self._kinds = np.zeros((256, 2), np.uint8)
        for row, kind in enumerate(layers.kinds):
            self._kinds[row] = kind.mucosa, kind.bone
        self._takers: dict[
            CuttingLimits, tuple[NDArray[np.float32], NDArray[np.uint8]]
        ] = {}
        self._undo: deque[_Before] = deque()
        self._undo_bytes = 0

    def carve(
        self,
        solids: solid.Rows,
        taker: CuttingLimits,
        *,
        time_s: float = 0.0,
        tool: str = "",
        stroke: int | None = None,
    ) -> Edit | None:
        """Cut a tool's solids out; None where nothing was there to be taken.

        solids: rows of `surgery.solids`. stroke: edits with the same number are undone
        together; None for a stroke of its own.
        """
        solids = solid.checked(solids)
        box = self._box(solids, REACH_MM)
        if np.any(box[3:] <= box[:3]):
            return None
        here = tuple(slice(box[a], box[a + 3]) for a in (2, 1, 0))
        old = self._distance[here].copy()
        old_fills = [fill[here].copy() for fill in self._fills]
        books = VolumeLedger(self.books.voxel_mm3)
        bounds = np.empty(6, np.int64)
        counts = books.by_label, books.by_wall
        changed = carve(
            self._distance,
            self._fills,
            self.pristine.distance.values,
            self._walls,
            self._tables(taker),
            solids,
            self._grid,
            REACH_MM,
            box,
            counts,
            bounds,
        )
        if changed == 0:
            return None
        before = books.counts
        loose = _loose_pieces(self._distance[here])
        if loose is not None:
            clear_pieces(
                self._distance,
                self._fills,
                self._walls,
                self._kinds,
                loose,
                box,
                self._spacing,
                counts,
            )
        books.pieces = books.counts - before
        mask = self._distance[here] != old
        k, j, i = np.nonzero(mask)
        low = np.array([i.min(), j.min(), k.min()], np.int64) + box[:3]
        high = np.array([i.max(), j.max(), k.max()], np.int64) + box[:3]
        _, ny, nx = self._distance.shape
        voxels = ((k + box[2]) * ny + j + box[1]) * nx + i + box[0]
        if books.counts == 0 and not np.any(old[mask] > -self._spacing):
            # only the distances of air: nothing was there
            self._distance.reshape(-1)[voxels] = old[mask]
            return None
        self.edits += 1
        self.generation += 1
        self._extend(low, high)
        edit = Edit(
            self.edits,
            time_s,
            self.edits if stroke is None else stroke,
            tool,
            solids,
            books.tissues(),
            books.walls(self.layers.kinds),
            books.mm3(books.pieces),
            books.counts,
            Change(self.generation, low, high),
        )
        self.books.add(books)
        self._keep(
            _Before(
                edit,
                books,
                voxels.astype(np.int32),
                old[mask],
                tuple(fill[mask] for fill in old_fills),
            )
        )
        self._follow(low, high)
        return edit

    def would_take(self, solids: solid.Rows, taker: CuttingLimits) -> dict[str, float]:
        """Return what `carve` would take, mm3 by tissue; nothing is cut."""
        solids = solid.checked(solids)
        box = self._box(solids, REACH_MM)
        books = VolumeLedger(self.books.voxel_mm3)
        if np.any(box[3:] <= box[:3]):
            return {}
        here = tuple(slice(box[a], box[a + 3]) for a in (2, 1, 0))
        fill, flesh, bone = (each[here].copy() for each in self._fills)
        kept = self.pristine.distance.values, *self._walls
        pristine, wall, ground = (each[here].copy() for each in kept)
        for each in pristine, wall, ground:
            each.flags.writeable = False  # else it would be compiled once more
        grid = self._grid.copy()
        grid[0] += box[:3] @ grid[1:4]
        carve(
            self._distance[here].copy(),
            (fill, flesh, bone),
            pristine,
            (wall, ground),
            self._tables(taker),
            solids,
            grid,
            REACH_MM,
            np.concatenate([np.zeros(3, np.int64), box[3:] - box[:3]]),
            (books.by_label, books.by_wall),
            np.empty(6, np.int64),
        )
        return books.tissues()

    def warm_up(self) -> None:
        """Compile what clears loose pieces: few cuts leave any, the first bite may."""
        nothing, nowhere = np.zeros((0, 0, 0), np.uint8), np.zeros(6, np.int64)
        counts = self.books.by_label, self.books.by_wall
        clear_pieces(
            self._distance,
            self._fills,
            self._walls,
            self._kinds,
            nothing,
            nowhere,
            self._spacing,
            counts,
        )

    def undo(self) -> Change | None:
        """Take the newest stroke back; None where nothing can be undone.

        What was bled is not undone.
        """
        if not self._undo:
            return None
        stroke = self._undo[-1].edit.stroke
        low, high = np.full(3, 1 << 30, np.int64), np.full(3, -1, np.int64)
        while self._undo and self._undo[-1].edit.stroke == stroke:
            step = self._undo.pop()
            self._undo_bytes -= step.bytes
            self._distance.reshape(-1)[step.voxels] = step.distance
            for fill, before in zip(self._fills, step.fills, strict=True):
                fill.reshape(-1)[step.voxels] = before
            self.books.add(step.books, -1)
            low = np.minimum(low, step.edit.change.low)
            high = np.maximum(high, step.edit.change.high)
        self.generation += 1
        self._follow(low, high)
        return Change(self.generation, low, high)

    def checkpoint(self) -> PatientState:
        """Return all that later edits may change."""
        voxels = self._cut_voxels()
        return PatientState(
            voxels,
            self._distance.reshape(-1)[voxels],
            tuple(fill.reshape(-1)[voxels] for fill in self._fills),
            self.books.copy(),
            tuple(self._undo),
            self.edits,
            self.touched,
        )

    def restore(self, state: PatientState) -> Change | None:
        """Make the patient what it was; None where it never differed.

        The generation goes on, so that whoever follows the patient notices.
        """
        here = self.touched
        if state.touched is not None:
            self._extend(*state.touched)
            here = self.touched
        voxels = self._cut_voxels()
        pristine = self.pristine.distance.values.reshape(-1)
        self._distance.reshape(-1)[voxels] = pristine[voxels]
        # fills before any cut were never kept; they depend on the voxels beside, too
        k, j, i = np.unravel_index(voxels, self._distance.shape)
        low = [max(int(a.min(initial=1 << 30)) - SHARED, 0) for a in (k, j, i)]
        high = [int(a.max(initial=-1)) + SHARED + 1 for a in (k, j, i)]
        around = tuple(slice(a, max(b, a)) for a, b in zip(low, high, strict=True))
        distance = np.ascontiguousarray(self.pristine.distance.values[around])
        wall = np.ascontiguousarray(self.layers.wall.values[around])
        first = tuple(np.empty(distance.shape, np.uint16) for _ in self._fills)
        inside = k - low[0], j - low[1], i - low[2]
        self._fill_up(distance, wall, first)
        self._distance.reshape(-1)[state.voxels] = state.distance
        for fill, full, then in zip(self._fills, first, state.fills, strict=True):
            fill.reshape(-1)[voxels] = full[inside]
            fill.reshape(-1)[state.voxels] = then
        self.books = state.books.copy()
        self._undo = deque(state.undo)
        self._undo_bytes = sum(step.bytes for step in state.undo)
        self.edits, self.touched = state.edits, state.touched
        if here is None:
            return None
        self.generation += 1
        self._follow(*here)
        return Change(self.generation, *here)

    @property
    def pristine_ct(self) -> NDArray[np.generic] | None:
        """Return the CT numbers before any cut; None where none were given."""
        return None if self.ct is None else self._first_ct

    def hash(self) -> str:
        """Return 32 hexadecimal digits of the carved distance and the fill."""
        digest = xxh3_128(self._distance.data)
        digest.update(self.fill.data)
        return digest.hexdigest()

    def _cut_voxels(self) -> NDArray[np.int64]:
        """Return the flat numbers of voxels whose distance is not the pristine one."""
        if self.touched is None:
            return np.zeros(0, np.int64)
        low, high = self.touched
        here = tuple(slice(low[a], high[a] + 1) for a in (2, 1, 0))
        differs = self._distance[here] != self.pristine.distance.values[here]
        k, j, i = np.nonzero(differs)
        _, ny, nx = self._distance.shape
        voxels: NDArray[np.int64] = ((k + low[2]) * ny + j + low[1]) * nx + i + low[0]
        return voxels

    def _fill_up(
        self,
        distance: NDArray[np.float32],
        wall: NDArray[np.uint8],
        fills: tuple[NDArray[np.uint16], ...],
    ) -> None:
        """Find the three fills of tissue that is whole."""
        fill, flesh, bone = fills
        fill_all(distance, 1.0 / self._spacing, fill)
        half = 0.5 * self._spacing
        share_out(distance, wall, self._thickness, half, fill, flesh, bone)

    def _box(self, solids: solid.Rows, reach_mm: float) -> NDArray[np.int64]:
        """Return voxels around solids: i0 j0 k0 i1 j1 k1, ends excluded."""
        low, high = solid.bounds(solids)
        corners = np.array(
            [
                [(low, high)[c >> a & 1][a] for a in range(3)]
                for c in range(8)
            ]
        )  # fmt: skip
        matrix = self.surface.distance.voxel_from_world
        voxels = corners @ matrix[:3, :3].T + matrix[:3, 3]
        reach = reach_mm / self.surface.distance.spacing_mm
        top = np.array(self._distance.shape[::-1], np.float64)
        first = np.clip(np.floor(voxels.min(axis=0) - reach), 0, top)
        end = np.clip(np.ceil(voxels.max(axis=0) + reach) + 1, 0, top)
        return np.concatenate([first, end]).astype(np.int64)

    def _tables(
        self, taker: CuttingLimits
    ) -> tuple[
        NDArray[np.float32], NDArray[np.float32], NDArray[np.uint8], NDArray[np.uint8]
    ]:
        """Return what `carve` must know of walls and of what the tool can do."""
        known = self._takers.get(taker)
        if known is None:
            spared = np.full(256, np.inf, np.float32)
            for row, kind in enumerate(self.layers.kinds):
                too_thick = kind.bone_mm > taker.bone_mm
                if kind.bone_mm > 0 and (too_thick or kind.fracture_n > taker.force_n):
                    spared[row] = kind.mucosa_mm
            hard = np.zeros(256, np.uint8)
            for label, tissue in TISSUE_OF.items():
                breaks = 0 < tissue.fracture_n <= taker.force_n
                stiff = tissue.stiffness_n_mm >= UNBREAKABLE_N_MM
                is_bone = FIRST_BONE <= label <= LAST_BONE
                thin = breaks and taker.bone_mm > 0
                hard[label] = stiff or (is_bone and not thin)
            known = self._takers[taker] = spared, hard
        return self._thickness, known[0], known[1], self._kinds

    def _extend(self, low: NDArray[np.int64], high: NDArray[np.int64]) -> None:
        if self.touched is not None:
            low = np.minimum(low, self.touched[0])
            high = np.maximum(high, self.touched[1])
        self.touched = low, high

    def _keep(self, before: _Before) -> None:
        self._undo.append(before)
        self._undo_bytes += before.bytes
        while self._undo_bytes > UNDO_BYTES and len(self._undo) > 1:
            self._undo_bytes -= self._undo.popleft().bytes

    def _follow(self, low: NDArray[np.int64], high: NDArray[np.int64]) -> None:
        """Bring the CT up to date within a box: what was taken is air."""
        if self.ct is None:
            return
        here = tuple(slice(low[a], high[a] + 1) for a in (2, 1, 0))
        first = np.empty(self.fill[here].shape, np.uint16)
        values = np.ascontiguousarray(self.pristine.distance.values[here])
        fill_all(values, 1.0 / self._spacing, first)
        share = self.fill[here] / np.maximum(first, 1).astype(np.float32)
        density = (self._first_ct[here].astype(np.float32) - AIR_HU) * share + AIR_HU
        cut = self.fill[here] != first
        self._ct[here] = np.where(
            cut, np.rint(density).astype(self._ct.dtype), self._first_ct[here]
        )


def _soft_walls(distance: Volume, labels: Volume | None) -> WallLayers:
    """Return walls of which nothing is known but the labels behind them."""
    ground = np.full(distance.shape, Label.MUCOSA, np.uint8)
    if labels is not None:
        values = labels.values.astype(np.uint8)
        ground = np.where(values >= Label.MUCOSA, values, ground)
    none = WallKind("", 0.0, 0.0, Label.MUCOSA, Label.MUCOSA)
    wall = np.full(distance.shape, NO_WALL, np.uint8)
    return WallLayers(
        distance.with_values(wall, 0.0),
        distance.with_values(ground, 0.0),
        (none,),
        source="unknown",
    )


def _wounds(
    distance: Volume,
    layers: WallLayers,
    film: NDArray[np.uint8],
    pale: NDArray[np.uint8],
) -> Wounds:
    """Turn walls into what shading reads, see `Wounds`."""
    thickness = layers.table()
    steps = np.clip(np.rint(thickness * _PER_UNIT), 0, 254).astype(np.uint8)
    wall, ground = layers.wall.values, layers.ground.values
    is_bone = (ground >= FIRST_BONE) & (ground <= LAST_BONE)
    bone = steps[:, 1][wall]
    flesh = np.where((bone > 0) | is_bone, steps[:, 0][wall], 255).astype(np.uint8)
    deep = np.where(is_bone, 255, 0).astype(np.uint8)
    return Wounds(
        distance,
        distance.with_values(flesh, 0.0),
        distance.with_values(bone, 0.0),
        distance.with_values(deep, 0.0),
        distance.with_values(film, 0.0),
        distance.with_values(pale, 0.0),
    )


def _loose_pieces(distance: NDArray[np.float32]) -> NDArray[np.uint8] | None:
    """Mark tissue in a box that hangs on nothing, with the rim of air that it fills.

    What reaches the box's faces hangs on what is outside. None where all tissue does.
    """
    tissue = distance > 0
    numbers, count = ndimage.label(tissue)
    if count <= 1:
        return None
    held = np.zeros(count + 1, bool)
    for axis in range(3):
        for end in (0, -1):
            held[np.unique(np.take(numbers, end, axis=axis))] = True
    held[0] = True
    if held.all():
        return None
    loose = ~held[numbers]
    around = ndimage.binary_dilation(loose) & ~tissue
    touched = ndimage.binary_dilation(tissue & ~loose)
    marked: NDArray[np.uint8] = (loose | (around & ~touched)).astype(np.uint8)
    return marked
