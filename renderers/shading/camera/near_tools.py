"""Tools beside the lens, out of its focus."""

import numpy as np
from numpy.typing import NDArray

from renderers.scene import GBuffer
from renderers.scene.gbuffer import read_only
from renderers.shading.bands import RowBands
from renderers.shading.kernels import near_tools as kernels
from renderers.shading.kernels.soil_lens import CELL, blur

_PICTURE_PX = 512
"""In a picture of this size what is far out of focus is blurred by a running mean of
three cells, twice: by 10 px. The cells themselves blur by 4."""


class NearTools:
    """Blur what is metal and nearer than a scope can focus; hold its buffers.

    The same bits for any number of threads.
    """

    def __init__(self, bands: RowBands) -> None:
        self._bands = bands
        self._seen = self._little = np.zeros((0, 0, 0), np.float32)
        self._far = self._other = self._little

    def look(
        self, radiance: NDArray[np.float32], gbuffer: GBuffer
    ) -> NDArray[np.float32]:
        """Return the light with near tools blurred: `radiance` itself without any.

        Valid until the next call.
        """
        material, depth = read_only(gbuffer.material), read_only(gbuffer.depth_mm)
        if not kernels.has_near(material, depth):
            return radiance
        height, width = gbuffer.size
        if self._seen.shape != radiance.shape:
            cells = -(-height // CELL), -(-width // CELL), kernels.SEVEN
            self._seen = np.empty(radiance.shape, np.float32)
            self._little = np.empty(cells, np.float32)
            self._far = np.empty(cells, np.float32)
            self._other = np.empty(cells, np.float32)
        light, seen = read_only(radiance), self._seen
        little, far = self._little, self._far

        def shrink(first: int, last: int) -> None:
            kernels.shrink_near(light, material, depth, little, far, first, last)

        def blend(first: int, last: int) -> None:
            kernels.blend_rows(light, material, depth, little, far, seen, first, last)

        self._bands.run(len(little), shrink)
        blur(far, self._other, round(min(height, width) / _PICTURE_PX))
        self._bands.run(height, blend)
        return seen
