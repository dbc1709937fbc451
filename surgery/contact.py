"""What a scope meets: walls hold it where nothing pushes back on the hand.

Mouse and gamepad feel no wall. Their scope goes as far as tissue lets it, and slides
along (see `surgery.kernels.hold_back`). With an arm nothing is moved: its scope is
where it is, and a contact is shown and scored.
"""

import numpy as np
from numpy.typing import NDArray

from disk import UserError
from renderers.scene import Volume
from surgery.kernels.hold_back import hold_back

APART_MM = 0.6
"""Between the balls of a shaft. One of 1.35 mm is 0.03 mm thinner between them."""

MOST_BALLS = 200

ITERATIONS = 12

SOFT = 0.25
"""The nostril gives way, a quarter as much as the tip."""

LEAST_LEVER_MM = 20.0
"""A shaft that is less deep than this is held by the hand outside."""


class ScopeHold:
    """Hold a scope's straight shaft in front of walls, within bounded time.

    The same poses and the same tissue give the same poses, bit by bit. Tissue is read
    as it is at the time: what was cut away no longer holds.
    """

    def __init__(
        self,
        distance: Volume,
        radius_mm: float,
        length_mm: float,
        pivot_mm: NDArray[np.float64],
        give_mm: float,
    ) -> None:
        """Take the air around a scope.

        distance: signed air distance, mm, negative in air; its values may be edited in
        place. radius_mm, length_mm: of the shaft that is held. pivot_mm: ``(3,)`` where
        the nostril holds it. give_mm: how deep a wall is dented by a touch.
        """
        if not (0.0 < radius_mm < length_mm and np.isfinite(length_mm)):
            raise UserError(
                f"a shaft of {length_mm} mm must be longer than its radius of "
                f"{radius_mm} mm"
            )
        if not 0.0 <= give_mm < np.inf:
            raise UserError(f"give_mm must not be negative, got {give_mm}")
        count = min(int((length_mm - radius_mm) / APART_MM) + 2, MOST_BALLS)
        along = np.linspace(radius_mm, length_mm, count)
        self._balls = np.stack([along, np.full(count, radius_mm)], axis=1)
        self._distance = distance
        self._voxel = np.ascontiguousarray(distance.voxel_from_world[:3])
        self._spacing_mm = float(distance.spacing_mm.max())
        self._pivot_mm = np.asarray(pivot_mm, np.float64)
        self._give_mm = give_mm
        # compiled, or fetched compiled, before the flight begins
        self(np.eye(4), np.eye(4))

    def __call__(
        self, start: NDArray[np.float64], wanted: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return the pose that a scope gets to, 4x4, on its way to a wanted one.

        start: where it is. Its least gap is kept, or the depth of a touch: it is never
        pushed deeper. A wanted pose that is not finite is refused: it stays.
        """
        if not np.all(np.isfinite(wanted)):
            return start
        away = float(np.linalg.norm(self._pivot_mm - start[:3, 3]))
        lever = max(away, LEAST_LEVER_MM)
        rod, aim = _rod(start, lever), _rod(wanted, lever)
        hold_back(
            self._distance.values,
            self._voxel,
            self._spacing_mm,
            self._balls,
            lever,
            rod,
            aim,
            self._give_mm,
            SOFT,
            ITERATIONS,
        )
        if np.array_equal(rod, aim):
            return wanted
        return _frame(rod, wanted)


def _rod(frame: NDArray[np.float64], lever: float) -> NDArray[np.float64]:
    """Return the tip and the shaft's point in the nostril, ``(6,)``."""
    return np.concatenate([frame[:3, 3], frame[:3, 3] + lever * frame[:3, 2]])


def _frame(
    rod: NDArray[np.float64], wanted: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the pose of a rod, rolled as wanted."""
    back = rod[3:] - rod[:3]
    back /= np.linalg.norm(back)
    right = wanted[:3, 0] - (wanted[:3, 0] @ back) * back
    right /= np.linalg.norm(right)
    frame = np.eye(4)
    frame[:3, 0], frame[:3, 1], frame[:3, 2] = right, np.cross(back, right), back
    frame[:3, 3] = rod[:3]
    return frame
