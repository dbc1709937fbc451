"""The round field stop with its notch, and the vignette, as factors of pixels."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from renderers.shading.camera.camera_settings import CameraSettings

_NOTCH_DEPTH = 0.045
"""The orientation mark at the top of the stop, in field radii."""
_NOTCH_DARK = 0.05
_STOP_EDGE_PX = 3.0


@lru_cache(maxsize=12)
def field_tables(
    settings: CameraSettings, extent: float, width: int, height: int
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return the vignette factor and the stop's factor of every pixel, ``(h, w)``."""
    half = min(width, height) / 2
    x = (np.arange(width) + 0.5 - width / 2) / half
    y = -(np.arange(height) + 0.5 - height / 2)[:, None] / half
    r = np.hypot(x, y)
    theta = np.minimum(r, 1.02) * extent
    vignette = np.cos(0.9 * theta) ** settings.vignette
    stop = np.ones_like(r)
    if settings.stop:
        stop = np.clip((1 - r) * half / _STOP_EDGE_PX, 0, 1)
        notch = (np.abs(x) < (r - (1 - _NOTCH_DEPTH)) * 0.9) & (y > 0)
        stop[notch] *= _NOTCH_DARK
    tables = vignette.astype(np.float32), stop.astype(np.float32)
    for table in tables:
        table.flags.writeable = False
    return tables
