"""A made volume, and cameras around it: what ranks draw when they are measured."""

import hashlib
from pathlib import Path

import numpy as np
from numpy.lib.format import open_memmap
from numpy.typing import NDArray

from renderers.scene import Camera, Projection, Scene, TransferFunction, Volume

ELEVATION_DEG = 20.0
SPREAD = 1.41
"""Of the volume's edge, what a picture shows."""


def folded_scene(side: int, layers: int | None = None) -> Scene:
    """Make folds of a ball with holes, about half of it seen.

    layers: fewer than all, of the same place in the world.
    """
    values = np.stack([_layer(side, z) for z in range(layers or side)])
    transfer = TransferFunction(
        np.array([-50.0, 100, 500]),
        np.array([[1.0, 0.5, 0.2], [0.2, 0.9, 0.4], [1, 1, 1]]),
        np.array([0.0, 0.01, 0.06]),
    )
    volume = Volume(values, np.ones(3), np.full(3, -side / 2), background=-500)
    return Scene(volume, transfer)


def write_folds(side: int, folder: Path) -> str:
    """Write the whole volume, layer by layer, as `DataStore` has it; get its digest.

    folder: the store's.
    """
    folder.mkdir(parents=True, exist_ok=True)
    made = folder / "layers.npy"
    values = open_memmap(made, "w+", np.int16, (side,) * 3)
    for z in range(side):
        values[z] = _layer(side, z)
    values.flush()
    del values
    with made.open("rb") as file:
        digest = hashlib.file_digest(file, "sha256").hexdigest()
    made.rename(folder / digest)
    return digest


def orbit(side: int, size: int, frames: int, step_deg: float = 3.0) -> list[Camera]:
    """Look from around, parallel rays, as the paper's animations did."""
    high = np.radians(ELEVATION_DEG)
    cameras = []
    for turn in np.radians(step_deg * np.arange(frames)):
        flat = np.cos(high) * np.array([np.cos(turn), np.sin(turn)])
        eye = 2.0 * side * np.array([*flat, np.sin(high)])
        cameras.append(
            Camera.looking_at(
                eye.tolist(),
                [0, 0, 0],
                extent=side * SPREAD,
                size=(size, size),
                projection=Projection.ORTHOGRAPHIC,
            )
        )
    return cameras


def _layer(side: int, z: int) -> NDArray[np.int16]:
    axis = np.linspace(-1, 1, side, dtype=np.float32)
    y, x = np.meshgrid(axis, axis, indexing="ij")
    height = float(axis[z])
    folds = 400 * np.sin(6 * x) * np.sin(5 * y) * np.sin(7 * height)
    ball = 300 * (1 - np.sqrt(x * x + y * y + height * height))
    layer: NDArray[np.int16] = (folds + ball).astype(np.int16)
    return layer
