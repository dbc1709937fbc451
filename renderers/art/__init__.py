"""The Active Ray Tracer: high-quality pictures by ray casting through cells."""

from renderers.art.quality import Quality
from renderers.art.tracer import (
    ActiveRayTracer,
    RenderReport,
    RenderStoppedError,
    render_among,
)

__all__ = [
    "ActiveRayTracer",
    "Quality",
    "RenderReport",
    "RenderStoppedError",
    "render_among",
]
