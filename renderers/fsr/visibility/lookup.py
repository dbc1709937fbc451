"""The set of visible blocks where the eye is now."""

import numpy as np
from numpy.typing import NDArray

from renderers.fsr.visibility.visible_sets import VisibleSets
from renderers.scene import Volume


class Standpoint:
    """Look up what an eye may see; the last answer is kept, since eyes move slowly.

    numbers: of the blocks that are asked about. Raises ValueError for sets of others.
    """

    def __init__(
        self, sets: VisibleSets, distance: Volume, numbers: NDArray[np.int32]
    ) -> None:
        if not np.array_equal(sets.numbers, numbers):
            raise ValueError(
                f"the visible sets are of {len(sets.numbers)} other blocks than the "
                f"{len(numbers)} of this surface; build or update them for it"
            )
        self._sets = sets
        self._distance = distance
        self._voxel_from_world = distance.voxel_from_world
        self._row = -1
        self._seen: NDArray[np.uint8] | None = None

    def seen_from(self, eye_mm: NDArray[np.float64]) -> NDArray[np.uint8] | None:
        """Give 1 per block that may be seen, else 0; None where nothing is known.

        That is outside the airway, and in tissue.
        """
        matrix = self._voxel_from_world
        at = matrix[:3, :3] @ eye_mm + matrix[:3, 3]
        row = self._sets.row(at)
        if row < 0 or self._distance.at_voxel(at) >= 0:
            return None
        if row != self._row:
            self._row, self._seen = row, self._sets.seen(row)
        return self._seen
