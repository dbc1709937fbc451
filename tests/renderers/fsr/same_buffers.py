"""Whether two G-buffers are one, to the bit."""

import numpy as np

from renderers.scene import GBuffer


def same(a: GBuffer, b: GBuffer) -> bool:
    """Compare all that a G-buffer holds."""
    return all(
        np.array_equal(getattr(a, name), getattr(b, name))
        for name in ("depth_mm", "normal", "coverage", "material")
    )
