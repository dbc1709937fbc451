"""Partial-volume coverage of the layers behind an air surface."""

import math

import numpy as np
from numba import njit

from anatomy.kernels.tables import (
    MEAN_DENSITY,
    Doubles,
    Floats,
    Grids,
    Painted,
    WallLayers,
)

UNEVEN_MM = 0.6
"""Up to this thickness a shell's density is as uneven as `Grids.density`; over a
thicker one it averages out."""


@njit(cache=True, nogil=True, error_model="numpy")
def layer_weights(
    a: float, total: float, mucosa: float, bone: float, blur: float, w: Doubles
) -> None:
    """Write the weights of air, mucosa, bone and ground at depth `a` of a wall to `w`.

    The wall is `total` mm thick with air on both sides: mucosa, bone and what is
    left of it between two equal shells. Interfaces share one coordinate, so the
    weights are differences of the normal distribution function and add to 1.
    """
    mucosa = min(mucosa, 0.5 * total)
    bone = min(bone, 0.5 * total - mucosa)
    s = 0.7071067811865476 / blur
    f0 = 0.5 * math.erfc(-a * s)
    f1 = 0.5 * math.erfc(-(a - mucosa) * s)
    f2 = 0.5 * math.erfc(-(a - mucosa - bone) * s)
    b = total - a
    g0 = 0.5 * math.erfc(-b * s)
    g1 = 0.5 * math.erfc(-(b - mucosa) * s)
    g2 = 0.5 * math.erfc(-(b - mucosa - bone) * s)
    w[0] = (1.0 - f0) + (1.0 - g0)
    w[1] = (f0 - f1) + (g0 - g1)
    w[2] = (f1 - f2) + (g1 - g2)
    w[3] = f2 + g2 - 1.0


@njit(cache=True, nogil=True, error_model="numpy")
def paint_layers(
    first: int,
    last: int,
    blur: float,
    band: np.float32,
    distance: Floats,
    g: Grids,
    layers: WallLayers,
    out: Painted,
) -> None:
    """Paint slices `first` to `last` of HU, labels and bone cover."""
    gap, part, structure, plate = g.gap, g.part, g.structure, g.plate
    density = g.density
    ground_hu, ground, ground_kind = g.ground_hu, g.ground, layers.ground_kind
    part_layers, structure_layers = layers.parts, layers.structures
    plate_layers, tissue_hu = layers.plates, layers.tissue_hu
    hu, labels, cover = out.hu, out.labels, out.bone_cover
    w = np.empty(4)
    for z in range(first, last):
        for y in range(distance.shape[1]):
            for x in range(distance.shape[2]):
                a = distance[z, y, x]
                p, s, behind = part[z, y, x], structure[z, y, x], ground[z, y, x]
                if p == 255:
                    hu[z, y, x] = ground_hu[z, y, x]
                    labels[z, y, x] = behind
                    cover[z, y, x] = 255 if ground_kind[0, behind] & 2 else 0
                    continue
                row = structure_layers[s] if s != 255 else part_layers[p]
                mucosa, bone, kind = row[0], row[1], row[4]
                q = plate[z, y, x]
                if q != 255:
                    bone, kind = plate_layers[q, 0], plate_layers[q, 1]
                elif ground_kind[p, behind] & 1:
                    bone = 0.0
                other = gap[z, y, x]
                total = 1e3
                if other < band:
                    total = max(a + other, 0.1)
                reach = 5.0 * blur
                if a < -reach and other > reach:
                    # Deep air, the most frequent case: no need for six error functions.
                    w[0], w[1], w[2], w[3] = 1.0, 0.0, 0.0, 0.0
                else:
                    layer_weights(a, total, mucosa, bone, blur, w)
                dense = 1.0
                if w[2] > 0.0:
                    dense = density[z, y, x] / MEAN_DENSITY
                    dense = 1.0 + (dense - 1.0) * min(1.0, UNEVEN_MM / bone)
                value = (
                    w[0] * tissue_hu[0]
                    + w[1] * tissue_hu[1]
                    + w[2] * (tissue_hu[1] + dense * (tissue_hu[2] - tissue_hu[1]))
                    + w[3] * ground_hu[z, y, x]
                )
                hu[z, y, x] = np.int16(math.floor(value + 0.5))
                solid = w[2] + (w[3] if ground_kind[p, behind] & 2 else 0.0)
                cover[z, y, x] = np.uint8(255.0 * min(max(solid, 0.0), 1.0) + 0.5)
                if a < 0:
                    if s == 255 or s < layers.first_open:
                        row = part_layers[p]
                    labels[z, y, x] = np.uint8(row[2])
                elif w[3] >= w[1] and w[3] >= w[2]:
                    labels[z, y, x] = behind
                elif w[1] >= w[2]:
                    labels[z, y, x] = np.uint8(row[3])
                else:
                    labels[z, y, x] = np.uint8(kind)
