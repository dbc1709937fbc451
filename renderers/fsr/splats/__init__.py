"""Mode `classic`: a fuzzy set drawn as shaded splats, the 1995 way."""

from renderers.fsr.splats.set_view import SplatMode, Traversal
from renderers.fsr.splats.splat_rasterizer import SplatRasterizer

__all__ = ["SplatMode", "SplatRasterizer", "Traversal"]
