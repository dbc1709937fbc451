"""Frames as files give them: rounded, or with axes that are not quite at right angles.

A volume has axes at right angles. Headers are written with few digits, and converters
keep the shear of a tilted gantry.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from system import UserError

ROUNDING_MM = 0.05
"""No voxel moved further: the header is rounded."""

MOST_MOVED = 0.5
"""Of the smallest spacing: further, values are interpolated on a new grid."""

MOST_SKEW = 0.1
"""Cosine between two axes that a tilted gantry and no other frame leaves."""


@dataclass(frozen=True, slots=True)
class Grid:
    """Values and a frame whose axes are at right angles.

    layers: each ``(nz, ny, nx)``. spacing_mm, origin_mm: ``(3,)``. direction:
    ``(3, 3)``, columns are axes. notes: what was done to bring it about.
    """

    layers: list[NDArray[Any]]
    spacing_mm: NDArray[np.float64]
    origin_mm: NDArray[np.float64]
    direction: NDArray[np.float64]
    notes: list[str]


def check_square(name: str, frame: NDArray[np.float64]) -> float:
    """Return the largest cosine between two axes; UserError for no frame of a scan."""
    axes = frame[:, :3] / np.linalg.norm(frame[:, :3], axis=0)
    skew = float(np.abs(axes.T @ axes - np.eye(3)).max())
    if not skew <= MOST_SKEW:
        raise UserError(
            f"{name} has axes that are not at right angles: {axes.round(4).tolist()}; "
            "resample it on a straight grid, as 3D Slicer's Resample Scalar/Vector/DWI "
            "Volume does"
        )
    return skew


def squared(
    name: str, layers: list[NDArray[Any]], frame: NDArray[np.float64], order: int
) -> Grid:
    """Put a frame's axes at right angles; where voxels would move, move the values.

    frame: ``(3, 4)`` mm of voxel indices x y z. order: of the interpolation, 1 for
    values and 0 for labels. Raises UserError for axes far from right angles.
    """
    skew = check_square(name, frame)
    spacing = np.linalg.norm(frame[:, :3], axis=0)
    axes = frame[:, :3] / spacing
    left, _, right = np.linalg.svd(axes)
    rigid = left @ right
    count = np.array(layers[0].shape[::-1])
    # about the middle, so that no corner moves further than it must
    half = (count - 1) / 2.0
    center = frame[:, :3] @ half + frame[:, 3]
    origin = center - rigid @ (spacing * half)
    ends = np.array(np.meshgrid(*([-h, h] for h in half))).reshape(3, 8)
    moved = float(np.linalg.norm((frame[:, :3] - rigid * spacing) @ ends, axis=0).max())
    degrees = float(np.degrees(np.arcsin(min(skew, 1.0))))
    if moved <= ROUNDING_MM:
        # to the bit where the header has it: recordings know a head by it
        return Grid(layers, spacing, frame[:, 3], rigid, [])
    told = f"axes of {name} are {degrees:.2f} degrees off a right angle: "
    if moved <= MOST_MOVED * spacing.min():
        told += f"they are put at right angles, which moves no voxel by {moved:.2f} mm"
        return Grid(layers, spacing, origin, rigid, [told])
    from scipy.ndimage import affine_transform

    reach = np.abs((rigid.T @ frame[:, :3] / spacing[:, None]) @ ends).max(axis=1)
    size = 2 * np.ceil(reach - half - 1e-6).clip(0).astype(int) + count
    origin = center - rigid @ (spacing * (size - 1) / 2.0)
    matrix = np.linalg.solve(frame[:, :3], rigid * spacing)
    offset = np.linalg.solve(frame[:, :3], origin - frame[:, 3])
    layers = [
        affine_transform(
            layer,
            matrix[::-1, ::-1],
            offset[::-1],
            tuple(size[::-1].tolist()),
            order=order,
            cval=float(layer.min()),
        )
        for layer in layers
    ]
    return Grid(layers, spacing, origin, rigid, [f"{told}it is resampled"])
