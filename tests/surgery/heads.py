"""Small heads to operate on, with walls that are known exactly."""

import numpy as np
from numpy.typing import NDArray

from anatomy.tissue import Label
from anatomy.wall_layers import WallKind, WallLayers
from renderers.scene import AirSurface, Volume
from surgery.patient import OperatedPatient

H = 0.5
SHAPE = (40, 44, 48)

NO_WALL = WallKind("", 0.0, 0.0, Label.MUCOSA, Label.MUCOSA)
PAPYRACEA = WallKind(
    "lamina papyracea", 1.0, 0.3, Label.MUCOSA, Label.LAMINA_PAPYRACEA, 9.2, "orbit"
)


def volume(values: NDArray[np.generic], background: float = 0.0) -> Volume:
    return Volume(values, np.full(3, H), np.zeros(3), background=background)


def surface_of(distance: NDArray[np.float32]) -> AirSurface:
    dull = np.zeros(distance.shape, np.uint8)
    return AirSurface(volume(distance, 6.0), volume(dull), volume(dull))


def floor_at(height_mm: float, shape: tuple[int, int, int] = SHAPE) -> AirSurface:
    """Tissue below a height along z, air above it."""
    z = H * np.arange(shape[0])[:, None, None]
    distance = np.broadcast_to(height_mm - z, shape)
    return surface_of(np.clip(distance, -12, 6).astype(np.float32))


def walled(
    surface: AirSurface, kind: WallKind = PAPYRACEA, ground: Label = Label.FAT
) -> WallLayers:
    """One kind of wall everywhere."""
    shape = surface.distance.shape
    return WallLayers(
        volume(np.full(shape, 1, np.uint8)),
        volume(np.full(shape, ground, np.uint8)),
        (NO_WALL, kind),
    )


def soft_patient(height_mm: float = 10.0) -> OperatedPatient:
    return OperatedPatient(floor_at(height_mm), None)


def remaining(patient: OperatedPatient) -> int:
    """All tissue that is left, in the units of the books."""
    return int(patient.fill.sum(dtype=np.int64))
