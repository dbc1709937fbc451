"""Periodic band-limited noise, from which surface detail is made.

A tile is a cube of Gaussian noise with one dominant wavelength, unit standard
deviation, and its own gradient beside each value, so that one trilinear tap gives
both the mottle and the bump. It repeats without a seam; a fixed rotation per octave
keeps the repeats of different octaves from lining up.
"""

import numpy as np
from numpy.typing import NDArray

from renderers.shading.kernels.surface_noise import TILE_SIZE, NoiseTile

# Orthonormal, proper: three turns by rational angles that share no axis.
_ROTATIONS = (
    ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
    ((0.36, 0.48, -0.8), (-0.8, 0.6, 0.0), (0.48, 0.64, 0.6)),
    ((0.6, 0.0, -0.8), (0.64, 0.6, 0.48), (0.48, -0.8, 0.36)),
)


def noise_tile(shortest_voxels: float, seed: int) -> NDArray[np.float32]:
    """Make a tile ``(64, 64, 64, 4)`` float32, indexed [z, y, x].

    Channels: value (zero mean, unit sd), then its derivative along x, y, z per tile
    voxel. The spectrum is a shell around frequency ``.7 / shortest_voxels``; nothing
    much is shorter than `shortest_voxels`. The same seed gives the same bits.
    """
    if not 2 <= shortest_voxels <= TILE_SIZE / 2:
        raise ValueError(
            f"shortest wavelength must be 2..{TILE_SIZE // 2} voxels, "
            f"got {shortest_voxels}"
        )
    n = TILE_SIZE
    white = np.random.default_rng(seed).standard_normal((n, n, n))
    k = np.fft.fftfreq(n)
    radius = np.sqrt(k[:, None, None] ** 2 + k[:, None] ** 2 + k**2)
    shell = np.exp(
        -(((radius - 0.7 / shortest_voxels) / (0.22 / shortest_voxels)) ** 2)
    )
    shell[0, 0, 0] = 0.0
    value = np.fft.ifftn(np.fft.fftn(white) * shell).real
    value /= value.std()
    # central differences, because the taps interpolate the value linearly
    gradient = [
        (np.roll(value, -1, axis) - np.roll(value, 1, axis)) / 2 for axis in (2, 1, 0)
    ]
    tile = np.stack([value, *gradient], axis=-1).astype(np.float32)
    tile.flags.writeable = False
    return tile


def stored_tile(tile: NDArray[np.float32]) -> NoiseTile:
    """Round a tile of `noise_tile` and repeat its first layers behind the last."""
    # one less than what 16 bits hold: a blend of two must not pass it by rounding
    unit = np.float32(np.abs(tile).max() / 32766)
    padded = np.pad(tile, ((0, 1), (0, 1), (0, 1), (0, 0)), mode="wrap")
    quads = np.round(padded / unit).astype(np.int16).reshape(-1)
    quads.flags.writeable = False
    return NoiseTile(quads, unit)


def tile_from_mm(
    wavelength_mm: float, voxels_per_wavelength: float, turn: int
) -> NDArray[np.float32]:
    """Return the ``(3, 3)`` float32 map from millimetres to tile voxels of an octave.

    turn: which of three fixed rotations (0, 1, 2).
    """
    if not (wavelength_mm > 0 and voxels_per_wavelength > 0):
        raise ValueError(
            f"wavelengths must be positive, got {wavelength_mm} mm and "
            f"{voxels_per_wavelength} voxels"
        )
    scale = voxels_per_wavelength / wavelength_mm
    return (np.array(_ROTATIONS[turn]) * scale).astype(np.float32)
