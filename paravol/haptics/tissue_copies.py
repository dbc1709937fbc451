"""Copies of a patient's tissue for a loop that may not wait and edits nothing.

Two copies of the distance stand in turn: the loop reads one while the thread that edits
brings the other up to date and then publishes it. Each copy takes over the boxes that
changed since it was last written, so an edit costs its own voxels and no more, and a
tool that moves costs nothing. The whole distance is kept: a shaft of 60 mm lies across
most of a box around it, and a copy that follows a tool would be made anew at 1 ms each
time.
"""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from paravol.haptics.kernels.publishing import count_one
from paravol.haptics.kernels.run_loop import Tissue
from renderers.scene import Change, ChangeKind
from surgery.force import whole_patch
from surgery.patient import OperatedPatient

Box = tuple[slice, slice, slice]


class TissueCopies:
    """Follow a patient's distance, two copies in turn; for the thread that edits."""

    def __init__(self, patient: OperatedPatient) -> None:
        """Copy the distance as it is now."""
        patch = whole_patch(patient)
        self._source: NDArray[np.float32] = patch.distance
        copies = self._source.copy(), self._source.copy()
        self._copies = tuple(copies)
        self._behind: tuple[list[Box], list[Box]] = ([], [])
        self.tissue = Tissue(
            patch._replace(distance=copies[0]),
            patch._replace(distance=copies[1]),
            np.zeros(1, np.int64),
            np.zeros(1, np.int64),
        )
        """What the loop reads."""

    def follow(self, changes: Iterable[Change]) -> None:
        """Take over what was cut, or came back, since the last call; publish it."""
        boxes = [_box_of(c) for c in changes if c.kind is ChangeKind.CUT]
        if not boxes:
            return
        for behind in self._behind:
            behind.extend(boxes)
        number = count_one(self.tissue.begun)
        target, behind = self._copies[number % 2], self._behind[number % 2]
        for box in behind:
            target[box] = self._source[box]
        behind.clear()
        count_one(self.tissue.published)


def _box_of(change: Change) -> Box:
    """Return a change's voxels as slices of z, y, x."""
    low, high = change.low, change.high
    z, y, x = (slice(int(low[a]), int(high[a]) + 1) for a in (2, 1, 0))
    return z, y, x
