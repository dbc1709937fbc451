"""The walls of a phantom's airways as rows of kinds: `WallLayers` out of its grids."""

import math

import numpy as np
from numpy.typing import NDArray

from anatomy.hazard_volumes import HazardVolumes
from anatomy.kernels import wall_rows as kernels
from anatomy.kernels.tables import Grids
from anatomy.phantom.coverage import layer_tables
from anatomy.phantom.model import Model
from anatomy.protection import protecting_walls
from anatomy.redistance import FARTHEST_MM
from anatomy.tissue import TISSUE_OF, TISSUES, Label
from anatomy.wall_layers import WallKind, WallLayers
from renderers.scene.volume import Volume

_PLAIN, _BARE, _CONCHA, _SEPTUM = range(4)
"""Classes of ground: with a shell, without one, a turbinate's and the septum's own."""

TURBINATE_BONE_MM, SEPTUM_BONE_MM = 0.4, 0.9
"""Plates inside the turbinates and the septum; `surroundings` builds them."""

_NAMES = {Label.UNCINATE: "uncinate process"}

THIN_MM = 0.5
"""Shells of bone up to this thick break like other thin bone."""

BONE_HU = 300.0
"""Between cells a scan shows lining, which their label calls septum: below this it is
no bone."""


def wall_layers(
    model: Model, grids: Grids, distance: Volume, hazards: HazardVolumes
) -> WallLayers:
    """Join part, structure, plate and ground of each voxel into one row of a table.

    A row tells what the CT was painted with: a structure's layers win over the
    part's, a plate's bone over both; some grounds carry no shell of bone. Rows differ
    by what they protect, too: see `protecting_walls`. Walls reach `FARTHEST_MM` deep.
    """
    kinds, lookup, ground_class = _kinds(model)
    rows = np.empty(distance.shape, np.int16)
    kernels.wall_rows(0, len(rows), grids, lookup, ground_class, rows)
    depth = np.asarray(distance.values)
    rounds = math.ceil(FARTHEST_MM / float(distance.spacing_mm[0]))
    kernels.spread(rows, depth, np.float32(FARTHEST_MM), rounds)
    wall, table = protecting_walls(kinds, rows, distance, hazards)
    return WallLayers(wall, distance.with_values(_ground(grids), 0.0), table)


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
                    if thick == 0.0:
                        label, name = Label(0), ""
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
