"""The Active Ray Tracer: high-quality pictures by ray casting through cells."""

from renderers.art.composed_rays import render_among
from renderers.art.quality import Quality
from renderers.art.tracer import ActiveRayTracer, RenderReport, RenderStoppedError

__all__ = [
    "ActiveRayTracer",
    "Quality",
    "RenderReport",
    "RenderStoppedError",
    "render_among",
]
