"""Which surfels an eye may see from where, found once for a patient."""

from renderers.fsr.visibility.lookup import Standpoint
from renderers.fsr.visibility.visible_sets import (
    BlockBounds,
    VisibleSets,
    build_visible_sets,
    update_visible_sets,
)

__all__ = [
    "BlockBounds",
    "Standpoint",
    "VisibleSets",
    "build_visible_sets",
    "update_visible_sets",
]
