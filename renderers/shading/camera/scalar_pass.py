"""The camera's picture by scalar kernels, one stage after the other.

For a numba that vectors do not know. The same picture as `SweptCamera` makes, but for
rounding; it takes three times as long.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from renderers.shading.bands import RowBands
from renderers.shading.camera.exposed_picture import ExposedPicture
from renderers.shading.camera.grain import grain_offset, grain_tile
from renderers.shading.camera.optics import Optics
from renderers.shading.kernels.camera_scalar import N as BLOCK
from renderers.shading.kernels.camera_scalar import (
    add_bloom,
    blur_across,
    blur_along,
    develop_rows,
    expose_rows,
    glare_rows,
)

Floats = NDArray[np.float32]


class StagedCamera:
    """Make pictures of one size, one at a time."""

    def __init__(self, optics: Optics, bands: RowBands, seed: int) -> None:
        self.optics = optics
        self._bands = bands
        shape = (optics.height, optics.width, 3)
        self._sharp, self._soft, self._softer, self._spare = (
            np.empty(shape, np.float32) for _ in range(4)
        )
        grain = np.moveaxis(grain_tile(seed), 0, 2)
        # a block of the kernel may start in the last column
        wrapped = np.concatenate([grain, grain[:, :BLOCK]], axis=1)
        self._grain = np.ascontiguousarray(wrapped)

    def expose(
        self, radiance: Floats, depth_mm: Floats, gain: float, frame_number: int
    ) -> ExposedPicture:
        """Expose a picture and blur it; not from two threads at once."""
        self._expose(np.ascontiguousarray(radiance), gain)
        if self.optics.has_bloom:
            self._bloom()
        return self._blurred(depth_mm, frame_number)

    def _expose(self, radiance: Floats, gain: float) -> None:
        (red, red_rows), (blue, blue_rows) = self.optics.red, self.optics.blue

        def rows(first: int, last: int) -> None:
            expose_rows(
                radiance,
                np.float32(gain),
                red.index,
                red.part,
                blue.index,
                blue.part,
                red_rows.index,
                red_rows.part,
                blue_rows.index,
                blue_rows.part,
                self._sharp,
                first,
                last,
            )

        self._run(rows)

    def _bloom(self) -> None:
        """Spread what exceeds white; on a quarter of the size, it is smooth."""
        optics = self.optics
        size = -(-optics.height // 4), -(-optics.width // 4), 3
        small = np.empty(size, np.float32)
        glare_rows(self._sharp, small, 0, small.shape[0])
        if not small.any():
            return
        once, twice = np.empty_like(small), np.empty_like(small)
        blur_along(small, optics.halo_taps, 1, once, 0, small.shape[0])
        blur_across(once, optics.halo_taps, 1, twice, 0, small.shape[0])
        glare, halo = optics.tone[-2:]
        bloom = glare * small + halo * twice
        self._run(lambda first, last: add_bloom(bloom, self._sharp, first, last))

    def _blurred(self, depth_mm: Floats, frame_number: int) -> ExposedPicture:
        optics = self.optics
        soft = softer = self._sharp
        if optics.has_defocus:
            soft, softer = self._soft, self._softer
            self._blur(self._sharp, soft, optics.soft_taps, 1)
            self._blur(soft, softer, optics.rest_taps, optics.spacing)
        row, column = grain_offset(frame_number)
        depth = np.ascontiguousarray(depth_mm).view()
        depth.flags.writeable = False
        picture = np.empty((optics.height, optics.width, 3), np.uint8)

        def rows(first: int, last: int) -> None:
            develop_rows(
                self._sharp,
                soft,
                softer,
                depth,
                optics.vignette,
                optics.stop,
                self._grain,
                row,
                column,
                optics.tone,
                picture,
                first,
                last,
            )

        return ExposedPicture(picture, rows)

    def _blur(self, source: Floats, into: Floats, taps: Floats, spacing: int) -> None:
        spare = self._spare
        self._run(
            lambda first, last: blur_along(source, taps, spacing, spare, first, last)
        )
        self._run(
            lambda first, last: blur_across(spare, taps, spacing, into, first, last)
        )

    def _run(self, rows: Callable[[int, int], None]) -> None:
        self._bands.run(self.optics.height, rows)
