"""A turbinate's head, pulled, turned, swollen and cut: splats beside bent rays."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from anatomy import Phantom, classic_transfer_function
from renderers.scene import AirSurface, Camera, GBuffer, Scene
from renderers.scene.deflection import Cut, Deflection, Rotation, Scaling, Translation
from renderers.shading import (
    CameraPass,
    Caster,
    ScopeLight,
    ScopeShader,
    Tier,
    scope_picture,
)

SIZE = 256

# head of the middle turbinate, right, and the way out of it
_PLACE = np.array([-5.9, 14.3, 24.0])
_OUT = np.array([0.09, -0.707, -0.702])
_RIGHT = np.array([1.0, 0.0, 0.0])
_DEEP = _PLACE - 2 * _OUT

DEFORMATIONS = {
    "pulled aside": Deflection((Translation(_DEEP, 7.0, 3.0 * _RIGHT),)),
    "turned": Deflection((Rotation(_PLACE, 8.0, _OUT, -1.0),)),
    "swollen": Deflection((Scaling(_DEEP, 7.0, 1.8),)),
    "shrunk": Deflection((Scaling(_DEEP, 7.0, 0.6),)),
    "swollen, then pulled": Deflection(
        (Scaling(_DEEP, 7.0, 1.5), Translation(_DEEP, 7.0, -2.0 * _RIGHT))
    ),
    "cut": Deflection((Cut(_PLACE - _OUT, 5.0, _RIGHT, 1.2),)),
    "cut narrowly": Deflection((Cut(_PLACE - _OUT, 4.0, _RIGHT, 0.5),)),
    "cut twice": Deflection(
        (
            Cut(_PLACE - _OUT, 5.0, _RIGHT, 1.0),
            Cut(_PLACE - _OUT, 5.0, np.array([0.0, 0.7, -0.7]), 0.8),
        )
    ),
    "cut, then pulled": Deflection(
        (Cut(_PLACE - _OUT, 5.0, _RIGHT, 1.2), Translation(_DEEP, 7.0, 2.0 * _RIGHT))
    ),
}

VIEWS = {
    "front": (np.array([-5.235, 8.632, 19.059]), _PLACE, 40.0),
    "near": (np.array([-5.3, 11.55, 22.38]), _PLACE, 40.0),
    "aside": (np.array([-6.135, 8.932, 20.259]), np.array([-5.9, 15.3, 22.0]), 50.0),
    "below": (np.array([-4.735, 7.632, 16.059]), _PLACE, 35.0),
}
"""Eye, target, half the field in degrees."""


def turbinate_scene(phantom: Phantom) -> Scene:
    """Return what is deformed."""
    surface = AirSurface(phantom.distance, phantom.blood, phantom.skin)
    return Scene(phantom.ct, classic_transfer_function(), surface=surface)


def turbinate_camera(view: str = "front") -> Camera:
    """Look at the turbinate; `VIEWS` has the names."""
    eye, target, extent_deg = VIEWS[view]
    extent = np.radians(extent_deg)
    return Camera.looking_at(eye, target, extent=extent, size=(SIZE, SIZE))


def turbinate_picture(
    scene: Scene,
    buffer: GBuffer,
    gain: float | None,
    view: str = "front",
    tier: Tier = Tier.LIVE,
    casters: Sequence[Caster] = (),
) -> tuple[NDArray[np.uint8], float]:
    """Light a buffer as live pictures are lit; give its picture and the gain.

    casters: tools that are in the buffer and in the light.
    """
    assert scene.surface is not None
    shader, camera_pass = ScopeShader(scene.surface, tier), CameraPass()
    camera = turbinate_camera(view)
    try:
        return scope_picture(
            buffer, camera, shader, camera_pass, ScopeLight(), gain, casters=casters
        )
    finally:
        shader.close()
        camera_pass.close()
