"""The walls of a phantom's airways as rows of kinds: `WallLayers` out of its grids."""

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from anatomy.hazard_volumes import UNIT_MM, HazardVolumes
from anatomy.kernels import wall_rows as kernels
from anatomy.kernels.tables import Grids
from anatomy.phantom.coverage import layer_tables
from anatomy.phantom.model import Model
from anatomy.redistance import FARTHEST_MM
from anatomy.tissue import TISSUE_OF, TISSUES, Label
from anatomy.wall_layers import NO_WALL, WallKind, WallLayers
from renderers.scene.volume import Volume

BETWEEN_MM = 1.0
"""What may lie between a wall's bone and the hazard that it protects."""

_PLAIN, _BARE, _CONCHA, _SEPTUM = range(4)
"""Classes of ground: with a shell, without one, a turbinate's and the septum's own."""

TURBINATE_BONE_MM, SEPTUM_BONE_MM = 0.4, 0.9
"""Plates inside the turbinates and the septum; `surroundings` builds them."""

PROTECTED = {
    "lamina papyracea": "orbit",
    "fovea ethmoidalis": "skull base",
    "cribriform plate": "skull base",
    "lateral lamella": "skull base",
}
"""What lies behind a plate wherever it is."""

_UNPROTECTED = frozenset(("septum",))
"""Hazards that begin at their own mucosa: no wall stands before them."""

_NAMES = {Label.UNCINATE: "uncinate process"}

THIN_MM = 0.5
"""Shells of bone up to this thick break like other thin bone."""

_BY_HAZARD = {
    "orbit": ("lamina papyracea", Label.LAMINA_PAPYRACEA),
    "skull base": ("fovea ethmoidalis", Label.FOVEA),
}
"""A cell's own thin wall is the plate of what lies behind it: zones of plates end
before the foremost cells do."""

_CELL_WALLS = frozenset(("ethmoid septum", "thin bone"))

BONE_HU = 300.0
"""Between cells a scan shows lining, which their label calls septum: below this it is
no bone."""


def wall_layers(
    model: Model, grids: Grids, distance: Volume, hazards: HazardVolumes
) -> WallLayers:
    """Join part, structure, plate and ground of each voxel into one row of a table.

    A row tells what the CT was painted with: a structure's layers win over the
    part's, a plate's bone over both; some grounds carry no shell of bone. Rows differ
    by what they protect, too: the nearest hazard that begins within `BETWEEN_MM`
    behind the bone. Walls reach `FARTHEST_MM` deep.
    """
    kinds, lookup, ground_class = _kinds(model)
    rows = np.empty(distance.shape, np.int16)
    kernels.wall_rows(0, len(rows), grids, lookup, ground_class, rows)
    depth = np.asarray(distance.values)
    rounds = math.ceil(FARTHEST_MM / float(distance.spacing_mm[0]))
    kernels.spread(rows, depth, np.float32(FARTHEST_MM), rounds)
    behind = _behind(kinds, rows, depth, hazards)
    hazard_count = len(hazards.names)
    codes = np.where(rows < 0, 0, 1 + rows * (hazard_count + 1) + behind)
    used = np.flatnonzero(np.bincount(codes.ravel()))
    table = [WallKind("", 0.0, 0.0, 0, 0)]
    row_of = np.full(int(used[-1]) + 1, NO_WALL, np.uint8)
    for code in used[used > 0].tolist():
        kind, hazard = divmod(code - 1, hazard_count + 1)
        row_of[code] = len(table)
        table.append(_protecting(kinds[kind], ("", *hazards.names)[hazard]))
    return WallLayers(
        distance.with_values(row_of[codes], float(NO_WALL)),
        distance.with_values(_ground(grids), 0.0),
        tuple(table),
    )


def _ground(grids: Grids) -> NDArray[np.uint8]:
    lining = (grids.ground == Label.ETHMOID_SEPTUM) & (grids.ground_hu < BONE_HU)
    return np.where(lining, np.uint8(Label.MUCOSA), grids.ground)


def _kinds(
    model: Model,
) -> tuple[list[WallKind], NDArray[np.int16], NDArray[np.uint8]]:
    """Return the kinds, the lookup of `kernels.wall_rows`, and its ground classes."""
    tables = layer_tables(model)
    bases = np.concatenate([tables.parts, tables.structures])
    ground_class = np.where(tables.ground_kind & 1, _BARE, _PLAIN).astype(np.uint8)
    ground_class[:, Label.TURBINATE_BONE] = _CONCHA
    ground_class[:, Label.SEPTAL_BONE] = _SEPTUM
    kinds: dict[WallKind, int] = {}
    lookup = np.empty((len(bases), len(model.plates) + 1, 4), np.int16)
    for b, (mucosa_mm, bone_mm, _, mucosa, bone) in enumerate(bases):
        for q in range(len(model.plates) + 1):
            for ground in (_PLAIN, _BARE, _CONCHA, _SEPTUM):
                label, thick, name = Label(int(bone)), float(bone_mm), ""
                if q < len(model.plates):
                    plate = model.plates[q]
                    label, thick, name = plate.label, plate.thickness_mm, plate.name
                elif ground == _CONCHA and thick == 0.0:
                    label, thick = Label.TURBINATE_BONE, TURBINATE_BONE_MM
                elif ground == _SEPTUM:
                    label, thick = Label.SEPTAL_BONE, SEPTUM_BONE_MM
                elif ground == _BARE or thick == 0.0:
                    label, thick = Label(0), 0.0
                strength = TISSUE_OF[label].fracture_n
                if thick > 0.0 and not name:
                    name = _NAMES.get(label, label.name.lower().replace("_", " "))
                    if label == Label.THICK_BONE and thick <= THIN_MM:
                        name, strength = "thin bone", TISSUES["thin bone"].fracture_n
                kind = WallKind(
                    name, float(mucosa_mm), thick, int(mucosa), int(label), strength
                )
                lookup[b, q, ground] = kinds.setdefault(kind, len(kinds))
    return list(kinds), lookup, ground_class


def _behind(
    kinds: list[WallKind],
    rows: NDArray[np.int16],
    depth: NDArray[np.float32],
    hazards: HazardVolumes,
) -> NDArray[np.uint8]:
    """Return the number, from 1, of the hazard that each wall protects; 0 for none."""
    reach = np.array(
        [kind.mucosa_mm + kind.bone_mm + BETWEEN_MM for kind in kinds], np.float32
    )
    least = np.full(rows.shape, np.iinfo(np.int16).max, np.int16)
    held = np.zeros(rows.shape, np.uint8)
    for number, name in enumerate(hazards.names, start=1):
        if name in _UNPROTECTED:
            continue
        kernels.nearest_hazard(
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
        if kind.name in PROTECTED:
            fixed[k] = hazards.names.index(PROTECTED[kind.name]) + 1
    return np.where(fixed[rows] > 0, fixed[rows], held)


_CREST_N = {"optic nerve": TISSUE_OF[Label.SPHENOID_WALL].fracture_n * 15.43 / 13.15}
"""The optic crest bore 15.43 N where the carotid's bore 13.15 N (sources in
`anatomy.tissue`)."""


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
