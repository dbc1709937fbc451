"""Potentially visible sets of surfels, found once for a patient, on request."""

from renderers.fsr.visibility.visible_sets import (
    BlockBounds,
    VisibleSetLookup,
    VisibleSets,
    build_visible_sets,
)

__all__ = [
    "BlockBounds",
    "VisibleSetLookup",
    "VisibleSets",
    "build_visible_sets",
]
