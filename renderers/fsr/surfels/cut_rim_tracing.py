"""Rims and faces of cuts in a splatted picture, as sharp as a ray sees them.

Discs stand out over the rims of a cut, blend its faces where they meet and lose the
thin leaves that it leaves. So the rays of pixels that show what is near a face are
followed through the deformation itself; what is farther from it is the splats'.
"""

import numpy as np
from numpy.typing import NDArray

from renderers.fsr.deformation import SEAM_MM
from renderers.fsr.kernels.cut_rims import DeflectedField, trace_cut_rims
from renderers.fsr.kernels.draw_surfels import GeometryPlanes
from renderers.scene import Camera, GBuffer, Volume
from renderers.scene.deflection import Cut, Deflection, maps_of
from renderers.scene.thread_pool import ThreadPool

PARTS_PER_THREAD = 8
"""Cuts lie unevenly over the rows."""


class CutRims:
    """Trace the pixels beside the cuts of a deflection.

    distance: of the undeformed surface, mm, negative in air.
    """

    def __init__(self, distance: Volume, deflection: Deflection) -> None:
        self._distance = distance
        self._field = DeflectedField(
            distance.values,
            1 / distance.spacing_mm,
            maps_of(deflection, distance),
            deflection.stretch,
        )
        self._has_cuts = any(isinstance(d, Cut) for d in deflection.deflectors)

    def trace(
        self,
        camera: Camera,
        pool: ThreadPool,
        result: GBuffer,
        done: NDArray[np.uint8],
    ) -> tuple[int, int]:
        """Change `result` in place; return the rays traced and the pixels corrected.

        done: one for each pixel, becomes 1 where a pixel was corrected. The bits do not
        depend on the pool's size.
        """
        if not self._has_cuts:
            return 0, 0
        volume = self._distance
        common = (
            self._field,
            SEAM_MM,
            (camera.eye_mm - volume.origin_mm) @ volume.direction,
            camera.frame[1:] @ volume.direction,
            volume.direction,
            camera.lens_table(),
            GeometryPlanes(result.depth_mm, result.normal, result.coverage),
            done,
        )
        height = result.size[0]
        parts = PARTS_PER_THREAD * pool.threads if pool.threads > 1 else 1

        def trace_part(part: int) -> tuple[int, int]:
            first, last = height * part // parts, height * (part + 1) // parts
            return trace_cut_rims(*common, first, last)

        counts = pool.map(trace_part, range(parts))
        return sum(c[0] for c in counts), sum(c[1] for c in counts)
