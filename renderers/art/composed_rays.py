"""Solid things inside a picture of rays."""

from renderers.art.tracer import ActiveRayTracer
from renderers.scene import Camera, GBuffer, Image
from renderers.scene.composition import before_solids


def render_among(tracer: ActiveRayTracer, camera: Camera, solids: GBuffer) -> Image:
    """Draw mode `classic` with opaque solids in it: linear RGBA and depth.

    solids: what the camera sees of them alone, as `Mesh.gbuffer` gives it. Rays end at
    a solid exactly, and what lies before it covers it by what it absorbs. The depth is
    the nearer of the solid's and the one where opacity passes one half. Raises
    ValueError where the buffer does not fit the camera.
    """
    image = tracer.render(camera, limit_mm=solids.depth_mm)
    return before_solids(image, tracer.scene, camera, solids)
