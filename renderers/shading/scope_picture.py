"""From a G-buffer to the finished endoscope picture, supersampled or not."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from renderers.scene import Camera, GBuffer
from renderers.scene.lens_state import CLEAN, LensState
from renderers.shading.camera.camera_pass import CameraPass
from renderers.shading.capsules import Caster
from renderers.shading.illumination import ScopeLight
from renderers.shading.shader import ScopeShader


def downsample_radiance(radiance: NDArray[np.float32]) -> NDArray[np.float32]:
    """Average linear radiance ``(2h, 2w, 3)`` over 2 x 2 pixels to ``(h, w, 3)``."""
    _require_even(radiance.shape[0], radiance.shape[1])
    total = radiance[0::2, 0::2] + radiance[0::2, 1::2]
    total += radiance[1::2, 0::2]
    total += radiance[1::2, 1::2]
    total *= np.float32(0.25)
    result: NDArray[np.float32] = total
    return result


def downsample_gbuffer(gbuffer: GBuffer) -> GBuffer:
    """Keep the nearest surface of each 2 x 2 pixels; average their coverage.

    The camera focuses by depth. At a silhouette the near edge must decide: a mean of
    both depths lies where nothing is, and where one of the four is empty it would be
    infinite.
    """
    _require_even(*gbuffer.size)
    parts = [
        GBuffer(
            gbuffer.depth_mm[row::2, column::2],
            gbuffer.normal[row::2, column::2],
            gbuffer.coverage[row::2, column::2],
            gbuffer.material[row::2, column::2],
        )
        for row in (0, 1)
        for column in (0, 1)
    ]
    nearest = parts[0].nearest(parts[1]).nearest(parts[2]).nearest(parts[3])
    mean = sum(part.coverage for part in parts) * np.float32(0.25)
    coverage = np.asarray(mean, dtype=np.float32)
    return GBuffer(nearest.depth_mm, nearest.normal, coverage, nearest.material)


def scope_picture(
    gbuffer: GBuffer,
    camera: Camera,
    shader: ScopeShader,
    camera_pass: CameraPass,
    light: ScopeLight,
    gain: float | None = None,
    frame_number: int = 0,
    casters: Sequence[Caster] = (),
    lens: LensState = CLEAN,
) -> tuple[NDArray[np.uint8], float]:
    """Return the sRGB picture ``(h, w, 3)`` uint8 of `camera`, and its gain.

    The G-buffer has the camera's size times ``shader.tier.supersampling``: render it
    with ``camera.with_size(...)`` of that size. casters: see `ScopeShader.shade`.
    lens: what lies on the front lens.
    """
    factor = shader.tier.supersampling
    fine = camera
    if factor > 1:
        fine = camera.with_size(camera.width * factor, camera.height * factor)
    if gbuffer.size != (fine.height, fine.width):
        raise ValueError(
            f"tier {shader.tier.name} needs a G-buffer of {fine.height, fine.width} "
            f"for a picture of {camera.height, camera.width}, got {gbuffer.size}"
        )
    radiance = shader.shade(gbuffer, fine, light, casters=casters)
    if factor > 1:
        radiance = downsample_radiance(radiance)
        gbuffer = downsample_gbuffer(gbuffer)
    return camera_pass.finish(
        radiance, gbuffer, camera, gain=gain, frame_number=frame_number, lens=lens
    )


def _require_even(height: int, width: int) -> None:
    if height % 2 or width % 2:
        raise ValueError(f"halving needs even sizes, got {height, width}")
