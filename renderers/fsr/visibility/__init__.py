"""Which surfels an eye may see from where, found once for a patient."""

from renderers.fsr.visibility.sets import (
    BlockBounds,
    VisibleSets,
    build_visible_sets,
    update_visible_sets,
)
from renderers.fsr.visibility.standpoint import Standpoint

__all__ = [
    "BlockBounds",
    "Standpoint",
    "VisibleSets",
    "build_visible_sets",
    "update_visible_sets",
]
