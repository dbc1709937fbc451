"""The unevenness of living walls, as a function of the place alone."""

import numpy as np
from numpy.typing import NDArray

_UNIT_DEVIATION = 0.1925
"""Standard deviation of Perlin noise with unit gradients (measured, 2e5 points)."""

_CELL_PER_WAVELENGTH = 0.65
"""Lattice spacing that puts about one bump on each wavelength."""

# wavelength mm, standard deviation mm, row, fade begins at y, fades over mm
_OCTAVES = (
    (11.0, 0.28, 0, 1e4, 1.0),
    (5.0, 0.13, 0, 1e4, 1.0),
    (2.4, 0.045, 0, 1e4, 1.0),
    (5.0, 0.42, 1, -65.0, 4.0),
)
# of bone: wavelength mm, share of the deviation, row: density, trabeculae
_GRAIN = ((9.0, 0.8, 0), (3.2, 0.6, 0), (5.0, 0.75, 1), (2.3, 0.66, 1))
LIMITS_MM = (0.7, 1.2)
"""Bounds of the two rows: walls thinner than twice the first would be pierced."""


def noise_tables(
    seed: int, factor: float
) -> tuple[
    NDArray[np.float32],
    NDArray[np.float32],
    NDArray[np.int32],
    NDArray[np.float32],
    NDArray[np.float32],
]:
    """Draw octaves, limits' inverses, permutation, unit gradients and bone's grain.

    Octaves ``(4, 16)`` are of the walls' waviness; grain ``(4, 16)`` has the rows of
    the bone's density and of its trabeculae, each of deviation 1. Each octave is turned
    and shifted at random: gradient noise vanishes at lattice points, and aligned
    lattices would show as a grid of nodes.
    """
    rng = np.random.default_rng([seed, 0x6E6F])

    def octave(wavelength: float, deviation: float, row: int) -> list[float]:
        turn, _ = np.linalg.qr(rng.standard_normal((3, 3)))
        matrix = turn / (wavelength * _CELL_PER_WAVELENGTH)
        shift = rng.uniform(0, 256, 3)
        return [row, factor * deviation / _UNIT_DEVIATION, *matrix.ravel(), *shift]

    rows = [[*octave(a, b, row), fade, over] for a, b, row, fade, over in _OCTAVES]
    gradients = rng.standard_normal((256, 3))
    gradients /= np.linalg.norm(gradients, axis=1, keepdims=True)
    permutation = rng.permutation(256).astype(np.int32)
    grain = np.array([[*octave(*known), 0.0, 1.0] for known in _GRAIN], np.float32)
    return (
        np.array(rows, dtype=np.float32),
        (1 / np.array(LIMITS_MM)).astype(np.float32),
        permutation,
        gradients.astype(np.float32),
        grain,
    )
