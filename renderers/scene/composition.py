"""Solid things inside a volume of mode `classic`: hidden and hiding, pixel by pixel."""

from collections.abc import Iterable

import numpy as np

from renderers.scene.camera import Camera
from renderers.scene.gbuffer import GBuffer, Material
from renderers.scene.image import Image
from renderers.scene.mesh import PlacedMesh
from renderers.scene.scene import Scene

ALBEDO = {
    Material.METAL: (0.55, 0.56, 0.58),
    Material.DARK_PLASTIC: (0.03, 0.03, 0.035),
}
"""Linear colours; other materials are grey."""

GREY = (0.4, 0.4, 0.4)


def solids_seen(camera: Camera, placed: Iterable[PlacedMesh]) -> GBuffer:
    """Return what a camera sees of meshes alone."""
    buffer = GBuffer.empty(camera.height, camera.width)
    for mesh, pose in placed:
        mesh.draw(buffer, camera, pose)
    return buffer


def before_solids(image: Image, scene: Scene, camera: Camera, solids: GBuffer) -> Image:
    """Put opaque solids behind what a renderer drew before them: linear RGBA, depth.

    image: of the scene, with depth, whose rays ended at the solids' depth. solids: what
    the camera sees of them alone, as instruments draw it. The depth is the nearer of
    the solid's and the image's.
    """
    depth = image.depth_mm
    assert depth is not None
    covered = solids.coverage > 0
    origin, ray = camera.rays(covered)
    met = np.nonzero(covered)
    places = origin + solids.depth_mm[met][:, None].astype(np.float64) * ray
    table = np.array([ALBEDO.get(material, GREY) for material in Material])
    light = scene.diffuse_light(solids.normal[met], places)
    color = np.asarray(table[solids.material[met]] * light, dtype=np.float32)
    rgba = image.rgba.copy()
    before = rgba[met]
    # a solid is opaque where it is, and its rim is as much of it as it covers
    share = (1 - before[:, 3:]) * solids.coverage[met][:, None]
    before[:, :3] += share * color
    before[:, 3:] += share
    rgba[met] = before
    return Image(rgba, np.minimum(depth, solids.depth_mm))
