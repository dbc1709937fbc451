"""Pictures that are drawn at once, and what is left of them."""

from renderers.art.strips.strip import RAYS_A_BLOCK, Blocks, Strip, draw_strip

__all__ = ["RAYS_A_BLOCK", "Blocks", "Strip", "draw_strip"]
