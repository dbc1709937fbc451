"""Deflectors as rows of numbers, for compiled maps."""

import numpy as np
from numpy.typing import NDArray

from renderers.scene.deflection.chain import Deflection
from renderers.scene.deflection.kinds import Cut, Rotation, Scaling, Translation
from renderers.scene.volume import Volume


def maps_of(deflection: Deflection, volume: Volume) -> NDArray[np.float64]:
    """Lay deflectors out along the volume's own axes; see `maps.kernels`."""
    maps = np.zeros((len(deflection.deflectors), 9))
    axes = volume.direction
    # a turn is seen the other way round in a mirrored array
    hand = np.sign(np.linalg.det(axes))
    for row, one in zip(maps, deflection.deflectors, strict=True):
        row[1:4] = axes.T @ (one.center_mm - volume.origin_mm)
        row[4] = one.radius_mm
        match one:
            case Translation():
                row[0], row[5:8] = 0, axes.T @ one.shift_mm
            case Rotation():
                row[0], row[5:8] = 1, hand * (axes.T @ one.axis)
                row[8] = one.angle_rad
            case Scaling():
                row[0], row[8] = 2, 1 / one.factor - 1
            case Cut():
                row[0], row[5:8], row[8] = 3, axes.T @ one.normal, one.pull_mm
            case _:
                raise TypeError(f"rays cannot be bent by a {type(one).__name__}")
    return maps
