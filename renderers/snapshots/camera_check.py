"""Whether a camera stands where one can see, or in the tissue itself."""

import numpy as np

from renderers.scene import Projection, Scene
from renderers.snapshots.deflector_request import to_deflection
from renderers.snapshots.request import ScopeWork, SnapshotRequest

ROUNDING = 1e-9
"""Of the way to the volume's middle."""


def camera_in_tissue(request: SnapshotRequest, scene: Scene) -> bool:
    """Tell whether the eye is in what it looks at.

    In mode scope: behind the surface of the air. In mode classic: where the transfer
    function lets less than all light through. Deflected tissue counts where it is
    seen. An orthographic view has no eye, and whoever stands beside the volume is not
    in it.
    """
    camera = request.to_camera()
    if camera.projection is Projection.ORTHOGRAPHIC:
        return False
    eye = camera.eye_mm
    if request.deflectors:
        eye = to_deflection(request.deflectors).pull_back(eye[None])[0]
    if isinstance(request.work, ScopeWork):
        if scene.surface is None:
            return False
        field = scene.surface.distance
    else:
        field = scene.volume
    # on a face one is in it, however its place is rounded
    eye = eye + ROUNDING * (field.center_mm - eye)
    voxel = field.voxel_from_world[:3, :3] @ eye + field.voxel_from_world[:3, 3]
    if np.any(voxel < 0) or np.any(voxel > np.array(field.shape[::-1]) - 1):
        return False
    value = field.sample(eye)
    if isinstance(request.work, ScopeWork):
        return bool(value > 0)
    _, kappa = scene.transfer_function.evaluate(value)
    return bool(np.max(kappa) > 0)
