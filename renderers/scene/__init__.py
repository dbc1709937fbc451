"""The vocabulary both renderers speak. Nothing here knows a renderer."""

from renderers.scene.aiming import UpWarning
from renderers.scene.camera import Camera, Projection
from renderers.scene.change import Change, ChangeKind
from renderers.scene.distortion import Distortion
from renderers.scene.gbuffer import GBuffer, Material
from renderers.scene.image import Image, save_png, srgb_from_linear
from renderers.scene.light import Light, four_lights
from renderers.scene.mesh import Mesh
from renderers.scene.metrics import ImageError, image_error, rmse_codes, ssim
from renderers.scene.scene import (
    AirSurface,
    PhongMaterial,
    Renderer,
    RestOffsets,
    Scene,
    Wounds,
)
from renderers.scene.spine import Spine
from renderers.scene.transfer import (
    TransferFunction,
    extinction_from_opacity,
)
from renderers.scene.volume import AIR_HU, Volume

__all__ = [
    "AIR_HU",
    "AirSurface",
    "Camera",
    "Change",
    "ChangeKind",
    "Distortion",
    "GBuffer",
    "Image",
    "ImageError",
    "Light",
    "Material",
    "Mesh",
    "PhongMaterial",
    "Projection",
    "Renderer",
    "RestOffsets",
    "Scene",
    "Spine",
    "TransferFunction",
    "UpWarning",
    "Volume",
    "Wounds",
    "extinction_from_opacity",
    "four_lights",
    "image_error",
    "rmse_codes",
    "save_png",
    "srgb_from_linear",
    "ssim",
]
