"""How much air is left around a straight shaft, or around a tool."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderers.scene import Volume
from system import UserError

_STEP_MM = 0.25
"""Distance between samples along the shaft. The distance field changes by at most
1 mm per mm, so a sample misses at most half a step of clearance."""

_FAR_MM = 1000.0
"""Clearance outside the field: more than any tool is long."""


@dataclass(frozen=True, slots=True)
class Clearance:
    """Report the smallest gap between a tool's surface and tissue.

    gap_mm: negative when the tool is in tissue.
    at_mm: ``(3,)`` world point on the tool's axis where the gap is smallest.
    """

    gap_mm: float
    at_mm: NDArray[np.float64]


def shaft_clearance(
    distance: Volume,
    world_from_tip: NDArray[np.float64],
    radius_mm: float,
    length_mm: float,
) -> Clearance:
    """Measure the gap of a round-ended straight shaft in a signed distance field.

    distance: mm, negative in air. What lies outside the field is outside the head
        and counts as air.
    world_from_tip: 4x4, origin at the tip's end face, +z back up the shaft. The
        shaft is a capsule: its end sphere is centred one radius behind the tip.
    """
    # Imported here: this module's names are needed where nothing is compiled.
    from renderers.scene.kernels.least_along import least_along

    count = _count(radius_mm, length_mm)
    voxel_from_world = distance.voxel_from_world
    back = world_from_tip[:3, 2]
    begin = world_from_tip[:3, 3] + radius_mm * back
    nearest, air = least_along(
        distance.values,
        -1.0,
        voxel_from_world[:3, :3] @ begin + voxel_from_world[:3, 3],
        voxel_from_world[:3, :3] @ (_STEP_MM * back),
        count,
        _FAR_MM,
    )
    return Clearance(air - radius_mm, begin + nearest * _STEP_MM * back)


def tool_clearance(distance: Volume, capsules: NDArray[np.float64]) -> Clearance:
    """Measure the gap of a tool's capsules in a signed distance field.

    distance: as for `shaft_clearance`. capsules: ``(n, 7)`` start, end and radius in
    the patient, mm; without any the gap is that of a tool far away.
    """
    # Imported here: this module's names are needed where nothing is compiled.
    from surgery.kernels.capsule_gap import capsule_gap

    at_mm = np.zeros(3)
    gap_mm = capsule_gap(
        distance.values,
        np.ascontiguousarray(distance.voxel_from_world[:3]),
        np.ascontiguousarray(capsules, np.float64),
        _STEP_MM,
        at_mm,
    )
    return Clearance(min(gap_mm, _FAR_MM), at_mm)


def _count(radius_mm: float, length_mm: float) -> int:
    count = int((length_mm - radius_mm + _STEP_MM / 2) / _STEP_MM) + 1
    if count < 1:
        raise UserError(
            f"a shaft of {length_mm} mm is shorter than its radius of {radius_mm} mm"
        )
    return count
