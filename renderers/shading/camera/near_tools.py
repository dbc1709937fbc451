"""Tools beside the lens, out of its focus."""

import numpy as np
from numpy.typing import NDArray

from renderers.scene import GBuffer
from renderers.scene.gbuffer import read_only
from renderers.shading.bands import RowBands
from renderers.shading.kernels import blur_near as kernels
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
        self._seen = self._small = np.zeros((0, 0, 0), np.float32)

    def look(
        self, radiance: NDArray[np.float32], gbuffer: GBuffer
    ) -> NDArray[np.float32]:
        """Return the light with near tools blurred: `radiance` itself without any.

        Valid until the next call.
        """
        height, width = gbuffer.size
        near = kernels.near_rows(
            read_only(gbuffer.material), read_only(gbuffer.depth_mm)
        )
        if near == (0, 0):
            return radiance
        reach = round(min(height, width) / _PICTURE_PX)
        # as far as light of the tool gets, in whole cells
        margin = (2 * reach + 2) * CELL
        top = max(near[0] // CELL * CELL - margin, 0)
        bottom = min(-(-near[1] // CELL) * CELL + margin, height)
        light = read_only(radiance[top:bottom])
        material = read_only(gbuffer.material[top:bottom])
        depth = read_only(gbuffer.depth_mm[top:bottom])
        if self._seen.shape != radiance.shape:
            cells = -(-height // CELL), -(-width // CELL), kernels.SEVEN
            self._seen = np.empty(radiance.shape, np.float32)
            self._small = np.empty((3, *cells), np.float32)
        self._seen[:top], self._seen[bottom:] = radiance[:top], radiance[bottom:]
        seen = self._seen[top:bottom]
        little, far, other = self._small[:, : -(-len(light) // CELL)]

        def shrink(first: int, last: int) -> None:
            kernels.shrink_near(light, material, depth, little, far, first, last)

        def blend(first: int, last: int) -> None:
            kernels.blend_rows(light, material, depth, little, far, seen, first, last)

        self._bands.run(len(little), shrink)
        blur(far, other, reach)
        self._bands.run(len(light), blend)
        return self._seen
