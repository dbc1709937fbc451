"""The layers behind the surface of a patient's own airway, estimated from CT numbers.

A wall of bone shows as a thin bright ridge beside the air. What it is made of cannot be
seen, and bone of 0.1 mm hardly at all: `WallLayers.uncertainty_mm` says how far off the
places are.
"""

import math

import numpy as np
from numpy.typing import NDArray

from anatomy.hazard_volumes import HazardVolumes
from anatomy.kernels import wall_profile as kernels
from anatomy.kernels.wall_rows import spread
from anatomy.protection import protecting_walls
from anatomy.redistance import FARTHEST_MM
from anatomy.tissue import TISSUES, Label
from anatomy.wall_layers import WallKind, WallLayers
from renderers.scene.volume import AIR_HU, Volume

MUCOSA_MM = (0.15, 0.3, 0.45, 0.6, 0.8, 1.0, 1.3, 1.7, 2.2, 3.0)
BONE_MM = (0.0, 0.12, 0.2, 0.3, 0.4, 0.55, 0.75, 1.0, 1.4, 2.0, 3.0)
"""Thicknesses that walls are sorted into."""

THIN_MM = 0.5
"""Bone up to this thick breaks like a wall between cells."""

LEAST_EXCESS_HU = 120.0
"""Above soft tissue; less is noise, or a membrane."""

SMOOTH_VOXELS = 2
"""Walls change slowly: an estimate is the median of those so near on the surface."""

NARROWEST_MM, WIDEST_MM = 0.2, 1.2
"""Bounds of the blur that scanners have."""

BONE_HU, FAT_HU = 300.0, -30.0
"""Ground above is bone; below, fat."""

UNCERTAINTY_MM = 0.5
"""Standard deviation that is stated of the bone's middle. On the phantom's own CT of
0.5 mm with noise, four fifths of the places on each wall were off by less than .22 to
.46 mm (lamina papyracea); the root mean square, outliers included, was .42 to .76."""


def estimate_walls(
    ct: Volume, distance: Volume, hazards: HazardVolumes | None = None
) -> WallLayers:
    """Estimate what lies behind the surface of a scanned airway.

    ct: CT numbers on cubic voxels. distance: signed air distance on the same grid, mm.
    Walls that end at a labelled orbit or skull base are named by it.
    """
    values, depth = np.asarray(ct.values), np.asarray(distance.values)
    spacing = float(ct.spacing_mm[0])
    mucosa, bone = _surface_layers(values, depth, spacing)
    known = np.isfinite(bone)
    mucosa, bone = (kernels.medians(layer, SMOOTH_VOXELS) for layer in (mucosa, bone))
    rows = np.full(depth.shape, -1, np.int16)
    steps = [
        np.searchsorted((np.array(bins[1:]) + bins[:-1]) / 2, layer[known])
        for bins, layer in ((MUCOSA_MM, mucosa), (BONE_MM, bone))
    ]
    rows[known] = steps[0] * len(BONE_MM) + steps[1]
    kinds = [_kind(m, b) for m in MUCOSA_MM for b in BONE_MM]
    rounds = math.ceil(FARTHEST_MM / spacing) + 1
    spread(rows, depth, np.float32(FARTHEST_MM), rounds)
    wall, table = protecting_walls(kinds, rows, distance, hazards)
    ground = np.full(depth.shape, Label.MUSCLE, np.uint8)
    ground[values > BONE_HU] = Label.THICK_BONE
    ground[values < FAT_HU] = Label.FAT
    # beside air a voxel is dark only because it is half air
    ground[(values < FAT_HU) & (depth < 2.0 * spacing)] = Label.MUSCLE
    return WallLayers(
        wall,
        distance.with_values(ground, 0.0),
        table,
        source="CT numbers",
        uncertainty_mm=UNCERTAINTY_MM,
    )


def edge_blur_mm(ct: Volume, distance: Volume) -> float:
    """Measure the blur of edges between air and tissue: standard deviation, mm.

    ct: CT numbers on cubic voxels. distance: signed air distance on the same grid, mm.
    """
    values, depth = np.asarray(ct.values), np.asarray(distance.values)
    return _edge_blur(values, depth, float(ct.spacing_mm[0]))


def _edge_blur(
    values: NDArray[np.generic], depth: NDArray[np.float32], spacing: float
) -> float:
    slopes = np.empty(200_000, np.float32)
    count = kernels.edge_slopes(values, depth, spacing, slopes)
    if not count:
        return NARROWEST_MM
    steepest = max(float(np.median(slopes[:count])), 1.0)
    return (TISSUES["mucosa"].hu - AIR_HU) / (steepest * math.sqrt(2.0 * math.pi))


def _surface_layers(
    values: NDArray[np.generic], depth: NDArray[np.float32], spacing: float
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    soft, hard = TISSUES["mucosa"].hu, TISSUES["thin bone"].hu
    blur = min(max(_edge_blur(values, depth, spacing), NARROWEST_MM), WIDEST_MM)
    levels = np.array([AIR_HU, soft, hard, LEAST_EXCESS_HU])
    mucosa = np.full(depth.shape, np.nan, np.float32)
    bone = np.full(depth.shape, np.nan, np.float32)
    kernels.wall_profiles(values, depth, spacing, blur, levels, mucosa, bone)
    return mucosa, bone


def _kind(mucosa_mm: float, bone_mm: float) -> WallKind:
    if bone_mm == 0.0:
        return WallKind("", mucosa_mm, 0.0, int(Label.MUCOSA), 0)
    thin = bone_mm <= THIN_MM
    return WallKind(
        "thin bone" if thin else "thick bone",
        mucosa_mm,
        bone_mm,
        int(Label.MUCOSA),
        int(Label.THICK_BONE),
        TISSUES["thin bone"].fracture_n if thin else 0.0,
    )
