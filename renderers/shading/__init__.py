"""The one look: shared shading and camera of mode `scope`.

Both renderers deliver a G-buffer; everything that makes it look like the inside of a
nose happens here, so that their pictures can differ in geometry only.
"""

from renderers.shading.camera.camera_pass import CameraPass
from renderers.shading.camera.camera_settings import CameraSettings
from renderers.shading.camera.exposure import AutoGain, meter
from renderers.shading.capsules import Caster
from renderers.shading.illumination import Detail, Effects, ScopeLight, Tier
from renderers.shading.scope_picture import (
    downsample_gbuffer,
    downsample_radiance,
    scope_picture,
)
from renderers.shading.shader import ScopeShader
from renderers.shading.surface_look import LOOK_VERSION

__all__ = [
    "LOOK_VERSION",
    "AutoGain",
    "CameraPass",
    "CameraSettings",
    "Caster",
    "Detail",
    "Effects",
    "ScopeLight",
    "ScopeShader",
    "Tier",
    "downsample_gbuffer",
    "downsample_radiance",
    "meter",
    "scope_picture",
]
