"""Which hazard each wall of an airway protects, and the table of walls that follows."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from anatomy.feel import with_feel
from anatomy.hazard_volumes import UNIT_MM, HazardVolumes
from anatomy.kernels.wall_rows import nearest_hazard
from anatomy.tissue import TISSUE_OF, Label
from anatomy.wall_layers import NO_WALL, WallKind
from renderers.scene.volume import Volume

BETWEEN_MM = 1.5
"""What may lie between a wall's bone and the hazard that it protects."""

PROTECTED = {
    "lamina papyracea": "orbit",
    "fovea ethmoidalis": "skull base",
    "cribriform plate": "skull base",
    "lateral lamella": "skull base",
}
"""What lies behind a plate wherever it is."""

_UNPROTECTED = frozenset(("septum",))
"""Hazards that begin at their own mucosa: no wall stands before them."""

_BY_HAZARD = {
    "orbit": ("lamina papyracea", Label.LAMINA_PAPYRACEA),
    "eye": ("lamina papyracea", Label.LAMINA_PAPYRACEA),
    "skull base": ("fovea ethmoidalis", Label.FOVEA),
    "brain": ("fovea ethmoidalis", Label.FOVEA),
}
"""A cell's own thin wall is the plate of what lies behind it: zones of plates end
before the foremost cells do, and a scan has no zones."""

_CELL_WALLS = frozenset(("ethmoid septum", "thin bone"))

_CREST_N = {"optic nerve": TISSUE_OF[Label.SPHENOID_WALL].fracture_n * 15.43 / 13.15}
"""The optic crest bore 15.43 N where the carotid's bore 13.15 N (sources in
`anatomy.tissue`)."""

_MOST_ROWS = 255


def protecting_walls(
    kinds: Sequence[WallKind],
    rows: NDArray[np.int16],
    distance: Volume,
    hazards: HazardVolumes | None,
) -> tuple[Volume, tuple[WallKind, ...]]:
    """Split kinds of walls by the hazard behind them.

    kinds: without hazards. rows: ``(nz, ny, nx)`` into them, -1 for no wall. distance:
    signed air distance, mm. A wall protects the nearest hazard that begins within
    `BETWEEN_MM` behind its bone. Return the volume and the table of `WallLayers`;
    kinds that no voxel has are left out.
    """
    names = () if hazards is None else hazards.names
    behind = _behind(kinds, rows, np.asarray(distance.values), hazards)
    codes = np.where(rows < 0, 0, 1 + rows * np.int32(len(names) + 1) + behind)
    counts = np.bincount(codes.ravel())
    used = np.flatnonzero(counts)
    used = used[used > 0]
    if len(used) >= _MOST_ROWS:
        # the rarest walls no longer say what they protect; each kind keeps one row more
        kinds_used = len(np.unique((used - 1) // (len(names) + 1)))
        rarest = used[np.argsort(counts[used], kind="stable")]
        rare = rarest[: len(used) - (_MOST_ROWS - 1 - kinds_used)]
        merged = np.arange(len(counts))
        merged[rare] = 1 + (rare - 1) // (len(names) + 1) * (len(names) + 1)
        codes = merged[codes]
        used = np.unique(merged[used])
    table = [WallKind("", 0.0, 0.0, 0, 0)]
    row_of = np.full(len(counts), NO_WALL, np.uint8)
    for code in used.tolist():
        kind, hazard = divmod(code - 1, len(names) + 1)
        row_of[code] = len(table)
        table.append(with_feel(_protecting(kinds[kind], ("", *names)[hazard])))
    return distance.with_values(row_of[codes], float(NO_WALL)), tuple(table)


def _behind(
    kinds: Sequence[WallKind],
    rows: NDArray[np.int16],
    depth: NDArray[np.float32],
    hazards: HazardVolumes | None,
) -> NDArray[np.uint8]:
    """Return the number, from 1, of the hazard that each wall protects; 0 for none."""
    held = np.zeros(rows.shape, np.uint8)
    if hazards is None:
        return held
    reach = np.array(
        [kind.mucosa_mm + kind.bone_mm + BETWEEN_MM for kind in kinds], np.float32
    )
    least = np.full(rows.shape, np.iinfo(np.int16).max, np.int16)
    for number, name in enumerate(hazards.names, start=1):
        if name in _UNPROTECTED:
            continue
        nearest_hazard(
            rows,
            reach,
            hazards.volumes[name].values,
            depth,
            np.float32(UNIT_MM),
            least,
            held,
            number,
        )
    fixed = np.zeros(len(kinds) + 1, np.uint8)
    for k, kind in enumerate(kinds):
        if PROTECTED.get(kind.name) in hazards.names:
            fixed[k] = hazards.names.index(PROTECTED[kind.name]) + 1
    return np.where(fixed[rows] > 0, fixed[rows], held)


def _protecting(kind: WallKind, hazard: str) -> WallKind:
    if kind.name in _CELL_WALLS and hazard in _BY_HAZARD:
        name, bone = _BY_HAZARD[hazard]
        strength = TISSUE_OF[bone].fracture_n
        return replace(
            kind, name=name, bone=int(bone), behind=hazard, fracture_n=strength
        )
    strength = kind.fracture_n
    if kind.bone == Label.SPHENOID_WALL:
        strength = _CREST_N.get(hazard, strength)
    return replace(kind, behind=hazard, fracture_n=strength)
