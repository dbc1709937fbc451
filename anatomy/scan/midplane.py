"""The plane that mirrors a head onto itself: what is right, left and in the middle.

Scans are rarely straight: the head is turned in its rest. Sides and the nose's middle
are therefore found by the head's own symmetry, not by the scanner's axes.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import affine_transform
from scipy.spatial.transform import Rotation

from renderers.scene.volume import Volume

HIGHEST_HU = 300.0
"""Bone and teeth count no more than this, or fillings would decide."""

LEVELS = ((8.0, 6.0, 4), (4.0, 3.0, 1), (4.0, 1.5, 1), (4.0, 0.75, 1))
"""Voxels in mm, step in degrees and steps to each side, from coarse to fine."""

LEAST_OVERLAP = 0.6
"""Of the scan's width that both halves must share."""

SURE = 0.5
"""Correlation of the halves below which the symmetry tells nothing."""


@dataclass(frozen=True, slots=True)
class Midplane:
    """The plane: ``normal @ point == offset_mm``, the normal to the left, LPS.

    agreement: correlation of the two halves, 1 for a head that is its mirror image.
    """

    normal: NDArray[np.float64]
    offset_mm: float
    agreement: float

    def aside(self, points_mm: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return how far points ``(..., 3)`` lie to the patient's left, in mm."""
        result: NDArray[np.float64] = points_mm @ self.normal - self.offset_mm
        return result


def find_midplane(ct: Volume) -> Midplane:
    """Find the plane under whose reflection a head's CT numbers correlate most.

    ct: cubic voxels along the patient's axes. The head may be turned and inclined by
    up to 24 degrees; between two voxels of 4 mm the place is interpolated. Where the
    halves are not alike (below `SURE`) the box's own middle is taken.
    """
    agreement, yaw, roll, along = -1.0, 0.0, 0.0, 0.0
    for voxel_mm, step, reach in LEVELS:
        values, spacing, middle = _coarse(ct, voxel_mm)
        tried = []
        for i in range(-reach, reach + 1):
            for j in range(-reach, reach + 1):
                angles = (yaw + step * i, roll + step * j)
                turned = _turned(values, _turn(*angles))
                found, shift = _mirrored(*turned)
                normal = _turn(*angles)[:, 0]
                tried.append((found, *angles, float(normal @ middle) + spacing * shift))
        agreement, yaw, roll, along = max(tried)
    if agreement < SURE:
        yaw = roll = 0.0
        along = float(ct.center_mm[0])
    return Midplane(_turn(yaw, roll)[:, 0], along, agreement)


def _coarse(
    ct: Volume, voxel_mm: float
) -> tuple[NDArray[np.float32], float, NDArray[np.float64]]:
    """Average blocks of voxels; gives values above air, their spacing and middle."""
    fine = float(ct.spacing_mm[0])
    # at least two voxels are left along each axis
    block = max(min(round(voxel_mm / fine), min(ct.shape) // 2), 1)
    nz, ny, nx = (n // block for n in ct.shape)
    kept = ct.values[: nz * block, : ny * block, : nx * block]
    values = np.clip(kept, -1000.0, HIGHEST_HU) + 1000.0
    blocks = values.reshape(nz, block, ny, block, nx, block)
    middle = ct.origin_mm + fine * (np.array([nx, ny, nz]) * block - 1) / 2
    return blocks.mean(axis=(1, 3, 5), dtype=np.float32), fine * block, middle


def _turn(yaw_deg: float, roll_deg: float) -> NDArray[np.float64]:
    """Return the head's axes as columns, x y z: turned about z, inclined about y."""
    turn = Rotation.from_euler("ZY", (yaw_deg, roll_deg), degrees=True)
    return np.asarray(turn.as_matrix(), dtype=np.float64)


def _turned(
    values: NDArray[np.float32], turn: NDArray[np.float64]
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Sample values along the turned axes; also give 1 where there are any."""
    # array axes run z, y, x
    matrix = turn[::-1, ::-1]
    middle = (np.array(values.shape) - 1) / 2
    start = middle - matrix @ middle
    turned = affine_transform(values, matrix, start, order=1, mode="nearest")
    seen = affine_transform(np.ones_like(values), matrix, start, order=1)
    return turned, (seen > 0.999).astype(np.float32)


def _mirrored(
    values: NDArray[np.float32], seen: NDArray[np.float32]
) -> tuple[float, float]:
    """Return the best correlation of a volume with its mirror image in x, and where.

    The place is in voxels from the middle. All reflections are tried at once: a sum
    over f(x) g(s - x) is a convolution of rows.
    """
    width = values.shape[-1]
    rows = [
        np.fft.rfft(array.reshape(-1, width).astype(np.float64), 2 * width, axis=1)
        for array in (seen, values * seen, values**2 * seen)
    ]

    def over(one: int, other: int) -> NDArray[np.float64]:
        product = (rows[one] * rows[other]).sum(axis=0)
        return np.fft.irfft(product, 2 * width)[: 2 * width - 1]

    count = over(0, 0)
    enough = count > LEAST_OVERLAP * count.max()
    count = np.maximum(count, 1.0)
    mean = over(1, 0) / count
    variance = np.maximum(over(2, 0) / count - mean**2, 1e-6)
    agreement = np.where(enough, (over(1, 1) / count - mean**2) / variance, -1.0)
    at = int(agreement.argmax())
    shift = 0.0
    if 0 < at < len(agreement) - 1:
        left, here, right = agreement[at - 1 : at + 2]
        bend = left - 2 * here + right
        if bend < -1e-12 and min(left, right) > -1.0:
            shift = 0.5 * (left - right) / bend
    return float(agreement[at]), float(at + shift - (width - 1)) / 2
