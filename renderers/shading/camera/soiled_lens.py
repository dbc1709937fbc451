"""Blood, mucus and fog on the front lens, drawn before the camera exposes."""

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from renderers.scene.gbuffer import read_only
from renderers.scene.lens_state import SECTORS, LensState
from renderers.shading.bands import RowBands
from renderers.shading.camera.grain import grain_offset
from renderers.shading.kernels import soil_lens as kernels

_BLUR_SHARE = 0.02
"""Half width of a running mean, in pictures: two of them make the blur of a smear."""

_PATCHES, _DROPS = 6.0, 16.0
"""Waves of the soil's pattern across a picture. The lens is far out of focus: nothing
finer shows."""
_DROPS_WEIGHT = 0.3

_MOST_DROPS = 24
_DROP_SHARE = 0.015, 0.045
"""Drops of water on a wet lens, and their radii in pictures."""


class SoiledLens:
    """Look through a lens that is not clean; hold its buffers.

    The same bits for any number of threads.
    """

    def __init__(self, bands: RowBands) -> None:
        self._bands = bands
        self._seen = np.zeros((0, 0, 3), np.float32)
        self._small = self._other = self._seen
        self._mean = np.zeros(3, np.float32)

    def look(
        self, radiance: NDArray[np.float32], state: LensState
    ) -> NDArray[np.float32]:
        """Return what comes through: `radiance` itself where the lens is clean.

        Valid until the next call.
        """
        if state.is_clean:
            return radiance
        height, width = radiance.shape[:2]
        if self._seen.shape != radiance.shape:
            cells = -(-height // kernels.CELL), -(-width // kernels.CELL)
            self._seen = np.empty(radiance.shape, np.float32)
            self._small = np.empty((*cells, 3), np.float32)
            self._other = np.empty((*cells, 3), np.float32)
        light, small, seen = read_only(radiance), self._small, self._seen
        kernels.shrink(light, small)
        kernels.mean_light(small, self._mean)
        reach = max(1, round(_BLUR_SHARE * min(height, width) / kernels.CELL))
        kernels.blur(small, self._other, reach)
        pattern = soil_pattern(min(height, width), width)
        row, column = grain_offset(state.seed)
        scale = len(pattern) / 256
        numbers = float(state.fog), round(row * scale), round(column * scale)
        amounts = _amounts(state, height, width)
        drops = _drops(state, height, width)

        def band(first: int, last: int) -> None:
            kernels.soil_rows(
                light,
                small,
                self._mean,
                pattern,
                amounts,
                drops,
                numbers,
                seen,
                first,
                last,
            )

        self._bands.run(height, band)
        return seen


def _amounts(state: LensState, height: int, width: int) -> NDArray[np.float32]:
    """Return how much blood and mucus there is in each cell, ``(h', w', 2)``.

    A sector is covered from its rim inwards, by its share of its area.
    """
    sector, part, tilt = _places(height, width)
    layers = []
    for each in (state.blood, state.mucus):
        share = np.array([*each, each[0]], np.float32)
        here = share[sector] + part * (share[sector + 1] - share[sector])
        layers.append(here + tilt * np.minimum(here, 1 - here))
    return np.ascontiguousarray(np.stack(layers, axis=2))


@lru_cache(maxsize=4)
def _places(
    height: int, width: int
) -> tuple[NDArray[np.intp], NDArray[np.float32], NDArray[np.float32]]:
    """Return each cell's sector, how far it is to the next, and how near the rim.

    The last is -1 in the middle and 1 at the rim, and evenly spread over the area.
    """
    cell, half = kernels.CELL, min(height, width) / 2
    x = (np.arange(-(-width // cell)) + 0.5) * cell - width / 2
    y = height / 2 - (np.arange(-(-height // cell))[:, None] + 0.5) * cell
    turn = np.arctan2(y, x) / (2 * math.pi) % 1.0 * SECTORS
    sector = np.minimum(turn.astype(np.intp), SECTORS - 1)
    tilt = 2 * np.minimum((x**2 + y**2) / half**2, 1) - 1
    return sector, (turn - sector).astype(np.float32), tilt.astype(np.float32)


def _drops(state: LensState, height: int, width: int) -> NDArray[np.float32]:
    """Return columns, rows and radii of drops, pixels, and how much they hide."""
    count = math.ceil(state.drops * _MOST_DROPS)
    rng = np.random.default_rng(state.seed)
    turn, away, size = rng.random((_MOST_DROPS, 3))[:count].T
    radius = min(height, width) * np.sqrt(away) / 2
    least, most = _DROP_SHARE
    # the last to come is the first to go, by shrinking
    grown = np.minimum(state.drops * _MOST_DROPS - np.arange(count), 1.0)
    table = [
        width / 2 + radius * np.cos(2 * math.pi * turn),
        height / 2 - radius * np.sin(2 * math.pi * turn),
        min(height, width) * grown * (least + (most - least) * size**2),
        np.full(count, 0.9),
    ]
    return np.ascontiguousarray(np.stack(table, axis=1), dtype=np.float32)


@lru_cache(maxsize=4)
def soil_pattern(size: int, width: int) -> NDArray[np.float32]:
    """Return how much soil each place takes until it is covered, ``(size, size + w)``.

    Periodic, with `width` columns again after each row. Evenly spread over 0..1: soil
    of .3 covers three tenths.
    """
    rng = np.random.default_rng(20)
    k = np.fft.fftfreq(size) * size
    far = np.hypot(k[:, None], k)
    total = np.zeros((size, size))
    for waves, weight in ((_PATCHES, 1.0), (_DROPS, _DROPS_WEIGHT)):
        white = np.fft.fft2(rng.standard_normal((size, size)))
        band = np.exp(-0.5 * (far / waves * 2) ** 2) * far
        layer = np.fft.ifft2(white * band).real
        total += weight * layer / max(float(layer.std()), 1e-12)
    rank = np.empty(total.size, np.float32)
    rank[np.argsort(total, axis=None)] = np.linspace(0.0, 1.0, total.size)
    pattern = rank.reshape(size, size)
    pattern = np.ascontiguousarray(pattern[:, np.arange(size + width) % size])
    pattern.flags.writeable = False
    return pattern
