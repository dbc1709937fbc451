"""A source of light in mode `classic`.

The four infinite lights of the 1995 splatter are the default; local lights attenuate
by nothing, as there.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from system import UserError


@dataclass(frozen=True, slots=True)
class Light:
    """Place one light.

    vector: ``(3,)`` world; for an infinite light the unit direction *towards* the
    light, for a local light its position in mm.
    color: ``(3,)`` linear radiance factor.
    """

    vector: NDArray[np.float64]
    color: NDArray[np.float64]
    is_local: bool = False

    def __post_init__(self) -> None:
        vector = np.array(self.vector, dtype=np.float64)
        color = np.array(self.color, dtype=np.float64)
        if vector.shape != (3,) or not np.all(np.isfinite(vector)):
            raise UserError(f"a light needs a finite (3,) vector, got {vector}")
        if color.shape != (3,) or not np.all(np.isfinite(color) & (color >= 0)):
            raise UserError(f"a light needs a (3,) colour >= 0, got {color}")
        if not self.is_local:
            length = float(np.linalg.norm(vector))
            if length == 0.0:
                raise UserError("an infinite light needs a direction, got zeros")
            vector = vector / length
        vector.flags.writeable = False
        color.flags.writeable = False
        object.__setattr__(self, "vector", vector)
        object.__setattr__(self, "color", color)


def four_lights() -> tuple[Light, ...]:
    """Return four infinite lights around the head: a white key, three dimmer fills.

    The paper used four infinite lights for its timings without saying where; these
    sit on a tetrahedron so that no side of a surface is black. The key, before, above
    and to the left of a head, is much the brightest: equal lights show no shape.
    """
    corners = ((1, -1, 1), (-1, -1, -1), (-1, 1, 1), (1, 1, -1))
    strengths = (0.8, 0.2, 0.12, 0.1)
    return tuple(
        Light(np.array(c, dtype=np.float64), np.full(3, s))
        for c, s in zip(corners, strengths, strict=True)
    )
