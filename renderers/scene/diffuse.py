"""Light on dull things of mode `classic`: ambient and diffuse, without shadows."""

import numpy as np
from numpy.typing import NDArray

from renderers.scene.scene import Scene


def diffuse_light(
    scene: Scene, normals: NDArray[np.floating], places: NDArray[np.floating]
) -> NDArray[np.float64]:
    """Give what a scene's lights leave at places, ``(n, 3)`` linear RGB.

    normals, places: ``(n, 3)`` world, the latter in mm. Nothing but ambient light falls
    on what looks away from a light, or has no normal.
    """
    material = scene.material
    light = np.full(normals.shape, material.ambient, np.float64)
    for source in scene.lights:
        towards = source.vector
        if source.is_local:
            towards = source.vector - places
            length = np.linalg.norm(towards, axis=1, keepdims=True)
            towards = towards / np.maximum(length, 1e-9)
        facing = np.maximum((normals * towards).sum(axis=1, keepdims=True), 0)
        light += material.diffuse * facing * source.color
    return light
