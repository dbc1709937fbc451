"""A slab in a uniform medium, and a metal board somewhere in it."""

import math

import numpy as np

from renderers.scene import (
    Camera,
    GBuffer,
    Light,
    Material,
    PhongMaterial,
    Projection,
    Scene,
    TransferFunction,
    Volume,
)

SIZE = 48
KAPPA = 0.05
METAL = np.array([0.55, 0.56, 0.58])
"""Lit by one light from the eye: 0.2 + 0.8."""


def slab(layers: int, first_mm: float) -> Scene:
    """Fill layers of 1 mm before the eye with a medium that is grey without light."""
    volume = Volume(
        np.zeros((41, layers, 41), np.int16),
        np.ones(3),
        np.array([-20.0, first_mm, -20.0]),
    )
    transfer = TransferFunction(
        np.array([-1.0, 1.0]), np.full((2, 3), 0.5), np.full(2, KAPPA)
    )
    light = Light(np.array([0.0, -1.0, 0.0]), np.ones(3))
    return Scene(volume, transfer, (light,), PhongMaterial(0.2, 0.8, 0.0))


def camera() -> Camera:
    return Camera.looking_at(
        (0, 0, 0),
        (0, 1, 0),
        extent=math.radians(10),
        size=(SIZE, SIZE),
        projection=Projection.PERSPECTIVE,
    )


def board(depth_mm: float) -> GBuffer:
    """A metal board facing the eye, on the right half of the picture."""
    solids = GBuffer.empty(SIZE, SIZE)
    right = slice(SIZE // 2, None)
    axis = camera().lens_table()[:, right, 2]
    solids.depth_mm[:, right] = depth_mm / axis
    solids.normal[:, right] = (0, -1, 0)
    solids.coverage[:, right] = 1
    solids.material[:, right] = Material.METAL
    return solids
