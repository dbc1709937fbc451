"""Scenes that the tests of mode `classic` share."""

import numpy as np
from numpy.typing import ArrayLike

from renderers.fsr import FuzzySet, Inclusion, extract_fuzzy_set
from renderers.fsr.kernels.view_planes import EQUIDISTANT, GridView
from renderers.scene import (
    Camera,
    PhongMaterial,
    Projection,
    Scene,
    TransferFunction,
    Volume,
)
from tests.scenes import even_lights

Splats = tuple[FuzzySet, Scene]


def view_from(
    at: ArrayLike, *, keys_per_mm: float = 30.0, near_mm: float = 6.0
) -> GridView:
    """Look along z from a place in a grid of 1 mm, with a round lens."""
    matrix = np.eye(3, 4, dtype=np.float32)
    matrix[:, 3] = -np.asarray(at)
    return GridView(
        np.zeros(3, np.float32),
        matrix,
        EQUIDISTANT,
        np.float32(60),
        90,
        90,
        np.float32(0),
        np.float32(keys_per_mm),
        np.float32(near_mm),
    )


def of_one_kappa(kappa: float) -> TransferFunction:
    """Give one colour and one extinction from density 50 on."""
    return TransferFunction(
        np.array([0.0, 50.0, 200.0]),
        np.tile([0.8, 0.6, 0.4], (3, 1)),
        np.array([0.0, kappa, kappa]),
    )


def unlit(volume: Volume, kappa: float) -> Splats:
    """Give all voxels of a volume that are not clear, in their own colour."""
    plain = PhongMaterial(ambient=1.0, diffuse=0.0)
    scene = Scene(volume, of_one_kappa(kappa), lights=(), material=plain)
    inclusion = Inclusion.opacity(scene.transfer_function, 1.0)
    return extract_fuzzy_set(volume, inclusion, 1e-4), scene


def slab(layers: int = 6, spacing: tuple[float, float, float] = (1, 1, 1)) -> Volume:
    """Give 40 x 40 voxels in some layers."""
    values = np.full((layers, 40, 40), 100, np.float32)
    return Volume(values, np.array(spacing, float), np.zeros(3), background=0.0)


def above(volume: Volume, half_mm: float = 8.0, size: int = 120) -> Camera:
    """Give a view from 80 mm above a volume's first slice, along its columns."""
    x, y, _ = volume.center_mm
    return Camera.looking_at(
        (x, y, 80.0),
        (x, y, 0.0),
        up=(0, 1, 0),
        extent=half_mm,
        size=(size, size),
        projection=Projection.ORTHOGRAPHIC,
    )


def blob(seed: int = 0) -> Splats:
    """Give splats of many densities and normals."""
    rng = np.random.default_rng(seed)
    values = rng.uniform(0, 120, (9, 10, 11)).astype(np.float32)
    volume = Volume(values, np.ones(3), np.zeros(3))
    scene = Scene(volume, of_one_kappa(0.8), lights=even_lights())
    return extract_fuzzy_set(volume, Inclusion.density(0, 120), 60.0), scene


def from_anywhere(
    rng: np.random.Generator,
    far: float,
    projection: Projection,
    widths: tuple[int, int] = (3, 200),
    heights: tuple[int, int] = (3, 200),
) -> Camera:
    """Give a view of a blob from any direction, so far from its middle or within it."""
    away = rng.normal(size=3)
    away *= (far + rng.random()) / np.linalg.norm(away)
    scale = 5 if projection is Projection.ORTHOGRAPHIC else 1
    return Camera.looking_at(
        np.array([5.0, 4.5, 4.0]) + away,
        rng.uniform(0, 10, 3),
        extent=float(rng.uniform(0.05, 1.2)) * scale,
        size=(int(rng.integers(*widths)), int(rng.integers(*heights))),
        projection=projection,
    )
