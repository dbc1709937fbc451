"""The pictures that errors are measured against, each made once in a run."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from renderers.art import ActiveRayTracer, Quality
from renderers.scene import Camera, GBuffer, ImageError, Scene, image_error
from system import UserError

REFERENCE_QUALITY = Quality(1 / 32, 1e-6)
"""A thirty-second of a voxel, and rays that end where a millionth is left: that
changes no channel by more than 1e-6 and saves nine tenths of the time."""

REFERENCE_NAME = "ART, step 1/32 voxel, cut-off 1e-6"

SURFACE_QUALITY = Quality(1 / 8, 0.0)
"""Enough for a surface: its depth is refined between two samples."""

SURFACE_NAME = "ART surface, step 1/8 voxel"


@dataclass(slots=True)
class References:
    """Make reference pictures and surfaces, by view and size, and keep them."""

    _pictures: dict[tuple[str, str, int], NDArray[np.float32]] = field(
        default_factory=dict
    )
    _buffers: dict[tuple[str, int], GBuffer] = field(default_factory=dict)

    def picture(
        self, view: str, quantity: str, scene: Callable[[], Scene], camera: Camera
    ) -> NDArray[np.float32]:
        """Return linear RGB over black, ``(h, w, 3)``."""
        key = view, quantity, camera.width
        if key not in self._pictures:
            tracer = ActiveRayTracer(scene(), REFERENCE_QUALITY, threads=2)
            self._pictures[key] = rgb_over_black(tracer.render(camera).rgba)
        return self._pictures[key]

    def gbuffer(self, view: str, scene: Callable[[], Scene], camera: Camera) -> GBuffer:
        """Return the air surface behind each pixel."""
        key = view, camera.width
        if key not in self._buffers:
            tracer = ActiveRayTracer(scene(), SURFACE_QUALITY, threads=2)
            self._buffers[key] = tracer.gbuffer(camera)
        return self._buffers[key]


def rgb_over_black(rgba: NDArray[np.float32]) -> NDArray[np.float32]:
    """Drop alpha: premultiplied colour is what is seen before black."""
    return np.ascontiguousarray(rgba[..., :3])


def depth_error(found: GBuffer, reference: GBuffer) -> ImageError:
    """Compare distances in mm where both met a surface.

    Raises UserError when they have no such pixel.
    """
    both = np.isfinite(found.depth_mm) & np.isfinite(reference.depth_mm)
    if not both.any():
        raise UserError("the two G-buffers have no surface in common")
    return image_error(found.depth_mm[both], reference.depth_mm[both])


def surface_counters(found: GBuffer, reference: GBuffer) -> dict[str, float]:
    """Say how normals and coverage of two G-buffers differ.

    normal_deg_mean, normal_deg_p99: angle between normals. near: share of the common
    pixels with depths that differ by less than .1 mm; the rest is mostly silhouettes.
    missing, extra: shares of the picture where only the reference, or only `found`,
    met a surface.
    """
    hit, wanted = np.isfinite(found.depth_mm), np.isfinite(reference.depth_mm)
    a = found.normal[hit & wanted].astype(np.float64)
    b = reference.normal[hit & wanted].astype(np.float64)
    depth = found.depth_mm[hit & wanted] - reference.depth_mm[hit & wanted]
    sine = np.linalg.norm(np.cross(a, b), axis=-1)
    angle = np.degrees(np.arctan2(sine, np.sum(a * b, axis=-1)))
    return {
        "normal_deg_mean": float(angle.mean()),
        "normal_deg_p99": float(np.percentile(angle, 99)),
        "near": float(np.mean(np.abs(depth) < 0.1)),
        "missing": float(np.mean(wanted & ~hit)),
        "extra": float(np.mean(hit & ~wanted)),
    }
