"""Mode `classic`: a fuzzy set drawn as shaded splats, the 1995 way."""

from renderers.fsr.classic.mode import SplatMode, Traversal
from renderers.fsr.classic.rasterizer import SplatRasterizer

__all__ = ["SplatMode", "SplatRasterizer", "Traversal"]
