"""Solid things inside a picture of splats."""

from renderers.fsr.renderer import FuzzySetRenderer
from renderers.scene import Camera, GBuffer, Image
from renderers.scene.composition import before_solids


def render_among(renderer: FuzzySetRenderer, camera: Camera, solids: GBuffer) -> Image:
    """Draw mode `classic` with opaque solids in it: linear RGBA and depth.

    solids: what the camera sees of them alone, as `Mesh.gbuffer` gives it. Splats
    behind a solid are left out at that pixel, those before it cover it by what they
    absorb. The depth is the nearer of the solid's and the one where half the light is
    gone. Raises ValueError where the buffer does not fit the camera.
    """
    image = renderer.render(camera, with_depth=True, limit_mm=solids.depth_mm)
    return before_solids(image, renderer.scene, camera, solids)
