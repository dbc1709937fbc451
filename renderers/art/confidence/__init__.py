"""Where a picture may hide a wall that its volume samples too coarsely."""

from renderers.art.confidence.wall_map import wall_confidence

__all__ = ["wall_confidence"]
