"""Solid things inside a volume of mode `classic`: hidden and hiding, pixel by pixel."""

import numpy as np
from numpy.typing import NDArray

from renderers.fsr.renderer import FuzzySetRenderer
from renderers.scene import Camera, GBuffer, Image, Material, Scene

ALBEDO = {
    Material.METAL: (0.55, 0.56, 0.58),
    Material.DARK_PLASTIC: (0.03, 0.03, 0.035),
}
"""Linear colours; other materials are grey."""

GREY = (0.4, 0.4, 0.4)


def render_among(renderer: FuzzySetRenderer, camera: Camera, solids: GBuffer) -> Image:
    """Draw mode `classic` with opaque solids in it: linear RGBA and depth.

    solids: what the camera sees of them alone, as instruments draw it. Splats behind a
    solid are left out at that pixel, those before it cover it by what they absorb.
    The depth is the nearer of the solid's and the one where half the light is gone.
    Raises ValueError where the buffer does not fit the camera.
    """
    image = renderer.render(camera, with_depth=True, limit_mm=solids.depth_mm)
    depth = image.depth_mm
    assert depth is not None
    origin, ray = camera.rays()
    met = solids.coverage > 0
    places = origin[met] + solids.depth_mm[met, None].astype(np.float64) * ray[met]
    color = _lit(renderer.scene, solids.material[met], solids.normal[met], places)
    rgba = image.rgba.copy()
    # a solid is opaque where it is, and its rim is as much of it as it covers
    share = (1 - rgba[met, 3:]) * solids.coverage[met, None]
    rgba[met, :3] += share * color
    rgba[met, 3:] += share
    return Image(rgba, np.minimum(depth, solids.depth_mm))


def _lit(
    scene: Scene,
    materials: NDArray[np.uint8],
    normals: NDArray[np.float32],
    places: NDArray[np.float64],
) -> NDArray[np.float32]:
    """Light solids as splats are: ambient and diffuse."""
    table = np.array([ALBEDO.get(material, GREY) for material in Material])
    light = np.full((len(places), 3), scene.material.ambient)
    for source in scene.lights:
        towards = source.vector - places if source.is_local else source.vector
        towards = np.broadcast_to(towards, places.shape)
        length = np.linalg.norm(towards, axis=1, keepdims=True)
        cosine = (normals * towards).sum(axis=1, keepdims=True) / length
        light = light + scene.material.diffuse * np.maximum(cosine, 0) * source.color
    return np.asarray(table[materials] * light, dtype=np.float32)
