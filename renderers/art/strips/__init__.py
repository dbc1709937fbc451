"""Pictures that are drawn at once, and what is left of them."""

from renderers.art.strips.strip import Blocks, Strip, draw_strip

__all__ = ["Blocks", "Strip", "draw_strip"]
