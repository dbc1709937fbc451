"""Several deflectors, one after the other."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from renderers.scene.deflection.deflector import Deflector, Points
from renderers.scene.deflection.kinds import Cut, Rotation, Scaling, Translation
from renderers.scene.volume import Volume

Map = Callable[[Points], Points]


@dataclass(frozen=True, slots=True)
class Deflection:
    """Move tissue by several deflectors, one after the other.

    deflectors: the first moves the undeformed tissue, the next what came of it.
    """

    deflectors: tuple[Deflector, ...] = ()

    @property
    def stretch(self) -> float:
        """Return a bound on how far what is seen moves for a mm of place."""
        return math.prod(deflector.stretch for deflector in self.deflectors)

    def pull_back(self, points: ArrayLike) -> Points:
        """Return which places of the undeformed tissue are seen at places x."""
        q = np.array(points, dtype=np.float64)
        for deflector in reversed(self.deflectors):
            q = _within(deflector, q, deflector.pull_back)
        return q

    def push_forward(self, points: ArrayLike) -> Points:
        """Return where places of the undeformed tissue are seen."""
        x = np.array(points, dtype=np.float64)
        for deflector in self.deflectors:
            x = _within(deflector, x, deflector.push_forward)
        return x

    def jacobian(self, points: ArrayLike) -> NDArray[np.float64]:
        """Return dq/dx at places x, ``(n, 3, 3)``."""
        x = np.array(points, dtype=np.float64)
        result = np.broadcast_to(np.eye(3), (len(x), 3, 3)).copy()
        for deflector in reversed(self.deflectors):
            some = deflector.inside(x)
            result[some] = deflector.jacobian(x[some]) @ result[some]
            x = _within(deflector, x, deflector.pull_back)
        return result

    def opening(self, points: ArrayLike) -> NDArray[np.float64]:
        """Return the distance (mm) from the nearest cut's face, negative in its gap."""
        x = np.array(points, dtype=np.float64)
        least = np.full(len(x), np.inf)
        for deflector in reversed(self.deflectors):
            least = np.minimum(least, deflector.opening(x))
            x = _within(deflector, x, deflector.pull_back)
        return least

    def moves(self, points: ArrayLike) -> NDArray[np.bool_]:
        """Return which places are in the ball of any deflector; the others stay."""
        places = np.asarray(points, dtype=np.float64)
        result = np.zeros(len(places), bool)
        for deflector in self.deflectors:
            result |= deflector.inside(places)
        return result


def _within(deflector: Deflector, points: Points, change: Map) -> Points:
    """Change the places inside the ball; the others are not touched."""
    some = deflector.inside(points)
    result = points.copy()
    result[some] = change(points[some])
    return result


def maps_of(deflection: Deflection, volume: Volume) -> NDArray[np.float64]:
    """Lay deflectors out along the volume's own axes; see `kernels.deflect`."""
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
