"""The steps of a job, in the order in which they are taken.

Between any two of them a process may die. The tests listen here and end it.
"""

from collections.abc import Callable
from enum import Enum, auto


class Step(Enum):
    """Name what has just been done."""

    DATA_STORED = auto()
    """By the client: an array is in the spool folder."""
    FILE_WRITTEN = auto()
    """By anybody: a file is complete, and does not have its name yet."""
    REQUEST_PUBLISHED = auto()
    """By the client: from here on the request is accepted."""
    CANCEL_ASKED = auto()
    """By the client."""
    REQUEST_LINKED = auto()
    """By rank 0: no other worker can claim the job."""
    ATTEMPT_MADE = auto()
    """By rank 0: the attempt is this worker's."""
    ATTEMPT_TOLD = auto()
    """By rank 0: the attempt's first status can be read."""
    ENTRY_REMOVED = auto()
    """By rank 0: the queue no longer shows the job."""
    SCENE_LOADED = auto()
    """By every rank."""
    FRAME_BEGUN = auto()
    """By every rank: it has rays to move."""
    RAYS_MOVED = auto()
    """By every rank: some packets of a frame went on."""
    RANK_DONE = auto()
    """By every rank: its rays are finished; others may still need its cells."""
    FRAME_COMPLETE = auto()
    """By rank 0: all ranks are done."""
    FRAME_LEFT = auto()
    """By the other ranks."""
    TILE_SHOWN = auto()
    """By rank 0: the client can see more of the picture."""
    WORK_SAVED = auto()
    """By rank 0: who takes the job over need not do this part again."""
    PICTURE_SHADED = auto()
    """By rank 0: in memory only."""
    PICTURE_WRITTEN = auto()
    """By rank 0: all but the result's own file."""
    RESULT_WRITTEN = auto()
    """By rank 0: the job is not called DONE yet."""
    JOB_ENDED = auto()
    """By rank 0: the status is final."""
    JOB_HIDDEN = auto()
    """By rank 0: a pruned job can no longer be found and is still there in part."""


class Reached:
    """Tell whoever watches that a step was taken; nobody does in earnest."""

    def __init__(self) -> None:
        self.watcher: Callable[[Step], None] | None = None

    def __call__(self, step: Step) -> None:
        """Tell it."""
        if self.watcher is not None:
            self.watcher(step)


reached = Reached()
"""Told by the code that takes the steps."""
