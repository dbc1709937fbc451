"""Blood, mucus and fog on the front lens, drawn before the camera exposes."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from renderers.scene.gbuffer import read_only
from renderers.scene.lens_state import LensState
from renderers.shading.bands import RowBands
from renderers.shading.camera.grain import grain_offset
from renderers.shading.kernels import soil_lens as kernels

_BLUR_SHARE = 0.02
"""Half width of a running mean, in pictures: two of them make the blur of a smear."""

_PATCHES, _DROPS = 6.0, 16.0
"""Waves of the soil's pattern across a picture. The lens is far out of focus: nothing
finer shows."""
_DROPS_WEIGHT = 0.3


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
        place = round(row * scale), round(column * scale)
        numbers = float(state.soil), float(state.fog), *place

        def band(first: int, last: int) -> None:
            kernels.soil_rows(
                light, small, self._mean, pattern, numbers, seen, first, last
            )

        self._bands.run(height, band)
        return seen


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
