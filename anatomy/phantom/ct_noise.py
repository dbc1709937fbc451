"""CT noise: correlated as a scanner's kernel leaves it, and fixed to the place.

White noise is a hash of the voxel's index in the head's lattice, so any field of view
has the same noise at the same place. A difference of Gaussians takes away the fine and
the slow part: reconstruction kernels do the first, the ramp filter the second.
"""

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from anatomy.phantom.lattice import Lattice

FINE_MM, COARSE_MM = 0.45, 1.3
"""Standard deviations of the two Gaussians; the spectrum peaks near 0.25 per mm."""

_REACH = 3.0
_SLAB = 24


def ct_noise(lattice: Lattice, seed: int, deviation_hu: float) -> NDArray[np.float32]:
    """Draw noise ``(nz, ny, nx)`` of the given standard deviation in HU."""
    h = lattice.spacing_mm
    margin = int(np.ceil(_REACH * COARSE_MM / h))
    nz, ny, nx = lattice.shape
    result = np.empty(lattice.shape, dtype=np.float32)
    gain = deviation_hu / _deviation(h)
    for z in range(0, nz, _SLAB):
        depth = min(_SLAB, nz - z)
        first = np.array(lattice.first) - margin + np.array([0, 0, z])
        shape = (depth + 2 * margin, ny + 2 * margin, nx + 2 * margin)
        band = _difference(white_noise(first, shape, seed), h)
        inside = (slice(margin, margin + depth),) + (slice(margin, -margin),) * 2
        result[z : z + depth] = gain * band[inside]
    return result


def _difference(white: NDArray[np.float32], h: float) -> NDArray[np.float32]:
    fine, coarse = (
        ndimage.gaussian_filter(white, s / h, mode="nearest", truncate=_REACH)
        for s in (FINE_MM, COARSE_MM)
    )
    band: NDArray[np.float32] = fine - coarse
    return band


def _deviation(h: float) -> float:
    """Return the standard deviation of the difference for white noise of 1."""
    margin = int(np.ceil(_REACH * COARSE_MM / h))
    point = np.zeros((2 * margin + 1,) * 3, dtype=np.float32)
    point[margin, margin, margin] = 1.0
    return float(np.linalg.norm(_difference(point, h)))


def white_noise(
    first: NDArray[np.int64], shape: tuple[int, int, int], seed: int
) -> NDArray[np.float32]:
    """Hash voxel indices to numbers of mean 0 and variance 1 (sum of four uniforms)."""
    axes = [
        (np.arange(n, dtype=np.int64) + a).astype(np.uint64)
        for n, a in zip(shape, first[::-1], strict=True)
    ]
    primes = (0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9)
    z, y, x = (a * np.uint64(p) for a, p in zip(axes, primes, strict=True))
    bits = z[:, None, None] + y[None, :, None] + x[None, None, :]
    bits += np.uint64(seed * 0xD6E8FEB86659FD93 % 2**64)
    for shift, factor in ((30, 0xBF58476D1CE4E5B9), (27, 0x94D049BB133111EB)):
        bits ^= bits >> np.uint64(shift)
        bits *= np.uint64(factor)
    bits ^= bits >> np.uint64(31)
    total = np.zeros(shape, dtype=np.float32)
    for k in range(4):
        total += ((bits >> np.uint64(16 * k)) & np.uint64(0xFFFF)).astype(np.float32)
    # Four uniforms on [0, 65535]: mean 131070, variance 4 * 65536^2 / 12.
    return (total - np.float32(131070.0)) / np.float32(65536.0 / np.sqrt(3.0))
