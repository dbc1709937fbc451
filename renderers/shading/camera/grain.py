"""The sensor's noise: one periodic tile, laid anew for every frame."""

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

SIDE = 256


@lru_cache(maxsize=2)
def grain_tile(seed: int) -> NDArray[np.float32]:
    """Return periodic grain ``(3, 256, 256)``, unit sd, correlated over .7 px."""
    white = np.random.default_rng(seed).standard_normal((SIDE, SIDE, 3))
    k = np.fft.fftfreq(SIDE)
    blur = np.exp(-2 * (math.pi * 0.7) ** 2 * (k[:, None] ** 2 + k**2))
    smooth = np.fft.ifft2(
        np.fft.fft2(white, axes=(0, 1)) * blur[..., None], axes=(0, 1)
    ).real
    grain = 0.75 * white + smooth
    grain /= grain.std()
    result = np.ascontiguousarray(np.moveaxis(grain, 2, 0), dtype=np.float32)
    result.flags.writeable = False
    return result


def grain_offset(frame_number: int) -> tuple[int, int]:
    """Return the tile's row and column in the picture's first pixel."""
    turn = _hash(frame_number)
    return turn % SIDE, turn // SIDE % SIDE


def _hash(counter: int) -> int:
    """Mix a counter into 32 well-spread bits (the finaliser of MurmurHash3)."""
    h = (counter + 0x9E3779B9) & 0xFFFFFFFF
    h = ((h ^ (h >> 16)) * 0x85EBCA6B) & 0xFFFFFFFF
    h = ((h ^ (h >> 13)) * 0xC2B2AE35) & 0xFFFFFFFF
    return h ^ (h >> 16)
