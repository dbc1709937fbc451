"""Tangent discs drawn into a G-buffer: the splats of mode `scope`."""

from renderers.fsr.surfels.surfel_rasterizer import SurfelRasterizer

__all__ = ["SurfelRasterizer"]
