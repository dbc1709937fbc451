"""Scenes small enough to be cast by every variant of the ray tracer."""

import math

import numpy as np
from numpy.typing import NDArray

from renderers.scene import (
    AirSurface,
    Light,
    PhongMaterial,
    Scene,
    TransferFunction,
    Volume,
    four_lights,
)


def smooth_noise(
    shape: tuple[int, int, int], seed: int, scale: float
) -> NDArray[np.float64]:
    """Sum a few plane waves: smooth, without symmetry, of about unit size."""
    rng = np.random.default_rng(seed)
    grid = np.stack(np.meshgrid(*(np.arange(n) for n in shape), indexing="ij"), -1)
    total = np.zeros(shape)
    for _ in range(12):
        wave = rng.normal(size=3) / scale
        total += np.sin(grid @ wave + rng.uniform(0, 2 * math.pi))
    return total / math.sqrt(6)


def make_scene(shape: tuple[int, int, int] = (34, 27, 41), seed: int = 5) -> Scene:
    """Make an anisotropic, rotated volume with clear, thin and opaque parts."""
    rng = np.random.default_rng(seed)
    spacing, origin = np.array([0.4, 0.6, 0.9]), np.array([-3.0, 5.0, 2.0])
    direction = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    noise = smooth_noise(shape, seed, 5.0)
    volume = Volume((300 * noise).astype(np.int16), spacing, origin, direction, -1000.0)
    transfer = TransferFunction(
        np.array([-150.0, 100.0, 100.01, 300.0]),
        rng.uniform(0.1, 1, (4, 3)),
        np.array([0.0, 0.0, 0.05, 0.9]),
    )
    lights = (*four_lights(), Light(np.array([3.0, 2, 30]), np.full(3, 0.4), True))
    zeros = np.zeros(shape, np.uint8)
    distance = volume.with_values((2 * noise + 0.8).astype(np.float32), 1.0)
    tint = distance.with_values(zeros, 0)
    return Scene(
        volume,
        transfer,
        lights,
        PhongMaterial(0.3, 0.8, 0.4, 12.0),
        AirSurface(distance, tint, tint),
    )


def rough_scene(shape: tuple[int, int, int], corner: tuple[int, int, int]) -> Scene:
    """Make noise seen through thin and thick extinction, without lights."""
    values = np.random.default_rng(4).integers(-300, 300, shape, np.int16)
    volume = Volume(values, np.array([0.5, 0.5, 0.8]), np.array(corner, np.float64))
    transfer = TransferFunction(
        np.array([0.0, 100, 300]),
        np.array([[1.0, 0.5, 0.2], [0.2, 0.9, 0.4], [1, 1, 1]]),
        np.array([0.0, 0.02, 0.5]),
    )
    return Scene(volume, transfer)


def even_lights() -> tuple[Light, ...]:
    """Give four infinite lights of about equal strength.

    Bounds on splats' errors were measured under these; a strong key light scales the
    errors of the splats that face it.
    """
    return tuple(
        Light(light.vector, np.full(3, strength))
        for light, strength in zip(four_lights(), (0.55, 0.4, 0.35, 0.3), strict=True)
    )
