"""The camera both renderers' pictures go through: optics, gain, tone, grain, stop."""

import math
from collections.abc import Callable
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from renderers.scene import Camera, GBuffer, Projection
from renderers.scene.lens_state import CLEAN, LensState
from renderers.scene.thread_pool import Future, ThreadPool
from renderers.shading.bands import RowBands
from renderers.shading.camera.camera_settings import CameraSettings
from renderers.shading.camera.developer import LEAST_ROWS, Developer
from renderers.shading.camera.exposure import meter
from renderers.shading.camera.near_tools import NearTools
from renderers.shading.camera.optics import make_optics
from renderers.shading.camera.soiled_lens import SoiledLens

Result = TypeVar("Result")


class CameraPass:
    """Turn radiance into the picture on the monitor.

    seed: of the grain. The same radiance, gain and frame number give the same bytes
    for any `threads`.
    """

    def __init__(
        self,
        settings: CameraSettings | None = None,
        threads: int | ThreadPool = 2,
        seed: int = 1,
    ) -> None:
        self.settings = settings or CameraSettings()
        self._bands = RowBands(threads)
        self._seed = seed
        self._near = NearTools(self._bands)
        self._lens = SoiledLens(self._bands)
        self._developer: Developer | None = None

    def finish(
        self,
        radiance: NDArray[np.float32],
        gbuffer: GBuffer,
        camera: Camera,
        *,
        gain: float | None = None,
        frame_number: int = 0,
        lens: LensState = CLEAN,
    ) -> tuple[NDArray[np.uint8], float]:
        """Return the sRGB picture ``(h, w, 3)`` uint8, and the gain of its exposure.

        gain: linear factor; None meters this picture (see `exposure.meter`).
        frame_number: picks the grain; pictures of different numbers differ in grain
        only. lens: what lies on it; it is metered, too. Not safe to call from two
        threads at once.
        """
        developer = self._developer_for(radiance, gbuffer, camera)
        radiance = self._lens.look(self._near.look(radiance, gbuffer), lens)
        if gain is None:
            gain = meter(radiance, gbuffer.material)
        _require_gain(gain)
        picture, develop = developer.expose(
            radiance, gbuffer.depth_mm, gain, frame_number
        )
        self._bands.run(len(picture), develop, LEAST_ROWS)
        return picture, gain

    def begin(
        self,
        radiance: NDArray[np.float32],
        gbuffer: GBuffer,
        camera: Camera,
        *,
        gain: float,
        frame_number: int,
        then: Callable[[NDArray[np.uint8]], Result],
        lens: LensState = CLEAN,
    ) -> Future[Result]:
        """Begin the picture that `finish` gives, and leave the rest to a thread.

        then: called there with the picture; its result is the future's. Before that is
        done no other picture may be asked for. The caller is back when all threads
        would have to wait for it.
        """
        developer = self._developer_for(radiance, gbuffer, camera)
        radiance = self._lens.look(self._near.look(radiance, gbuffer), lens)
        _require_gain(gain)
        picture, develop = developer.expose(
            radiance, gbuffer.depth_mm, gain, frame_number
        )
        return self._bands.begin(len(picture), develop, lambda: then(picture))

    def prepare(self, camera: Camera) -> None:
        """Make the tables of a size, which are kept; safe beside a picture in work."""
        make_optics(self.settings, camera.extent, camera.width, camera.height)

    def close(self) -> None:
        """End the threads."""
        self._bands.close()

    def _developer_for(
        self, radiance: NDArray[np.float32], gbuffer: GBuffer, camera: Camera
    ) -> Developer:
        """Keep tables and memory from picture to picture of one size."""
        height, width = camera.height, camera.width
        if radiance.shape != (height, width, 3) or radiance.dtype != np.float32:
            raise ValueError(
                f"radiance must be float32 {(height, width, 3)} for this camera, got "
                f"{radiance.dtype} {radiance.shape}"
            )
        if gbuffer.size != (height, width):
            raise ValueError(
                f"G-buffer of {gbuffer.size} does not fit a camera of {height, width}"
            )
        if camera.projection is not Projection.EQUIDISTANT:
            raise ValueError(
                f"the scope's camera needs an equidistant lens, got "
                f"{camera.projection.name.lower()}"
            )
        if min(height, width) < 8:
            raise ValueError(f"a picture needs at least 8 pixels: {height, width}")
        optics = make_optics(self.settings, camera.extent, camera.width, camera.height)
        if self._developer is None or self._developer.optics is not optics:
            self._developer = Developer(optics, self._bands, self._seed)
        return self._developer


def _require_gain(gain: float) -> None:
    if not (math.isfinite(gain) and gain > 0):
        raise ValueError(f"a gain is positive and finite, got {gain}")
