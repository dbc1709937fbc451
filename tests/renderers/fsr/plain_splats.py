"""A picture of splats under an orthographic lens in float64: slow and obvious."""

import numpy as np
from numpy.typing import NDArray

from renderers.fsr import FuzzySet
from renderers.fsr.splats.shaded_set import splat_peaks
from renderers.scene import Camera, Scene
from tests.renderers.fsr.plain_footprint import gaussian_footprint

SIGMA = 0.6
"""Of a footprint, in voxels."""
ANTIALIAS = 0.3
"""Variance in square pixels that every footprint has at least."""


def orthographic_picture(
    fuzzy: FuzzySet, scene: Scene, camera: Camera
) -> NDArray[np.float64]:
    """Composite all splats, far ones first; ``(h, w, 4)`` premultiplied.

    The footprint of a voxel is the projection of a Gaussian with its three spacings
    (EWA splatting). The optical depth at its centre keeps the voxel's mass.
    """
    rows = fuzzy.rows
    center = rows.centers_mm()
    pixel, depth = camera.project(center)
    color, kappa = scene.transfer_function.evaluate(fuzzy.value.astype(np.float64))
    light = np.full((len(center), 3), scene.material.ambient)
    for source in scene.lights:
        facing = np.maximum(fuzzy.normals() @ source.vector, 0)
        light += scene.material.diffuse * facing[:, None] * source.color
    color = color * light
    scale = min(camera.width, camera.height) / 2 / camera.extent
    axes = camera.frame[1:3] @ rows.world_from_voxel[:3, :3] * [[1], [-1]]
    spread = (SIGMA * scale) ** 2 * axes @ axes.T + ANTIALIAS * np.eye(2)
    voxel_mm3 = abs(np.linalg.det(rows.world_from_voxel[:3, :3]))
    mass = SIGMA**2 * scale**2 * voxel_mm3 / np.sqrt(np.linalg.det(spread))
    peak = splat_peaks(kappa * mass)
    inverse = np.linalg.inv(spread)
    v, u = np.indices((camera.height, camera.width)) + 0.5
    image = np.zeros((camera.height, camera.width, 4))
    for s in np.argsort(-depth, kind="stable"):
        away = np.stack([u - pixel[s, 0], v - pixel[s, 1]], axis=-1)
        r2 = np.einsum("...i,ij,...j->...", away, inverse, away)
        a = (peak[s] * gaussian_footprint(r2))[..., None]
        image += a * (np.append(color[s], 1.0) - image)
    return image
