"""Strips of a picture that are drawn at once, and what is left of them."""

from renderers.art.strips.strip import Strip, draw_strip

__all__ = ["Strip", "draw_strip"]
