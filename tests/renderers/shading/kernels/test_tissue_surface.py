import numpy as np
import pytest

from renderers.shading.kernels import pixel_block as b
from renderers.shading.kernels.tissue_surface import tint_at


def test_tint_outside_the_grid_is_that_of_its_edge() -> None:
    tint = np.arange(64, dtype=np.uint16)
    points = np.array([[0, 0, 0], [-50, -1, -0.1], [99, 99, 99]])
    w = np.zeros(b.SLOTS, np.float32)
    for slot, values in zip((b.UX, b.UY, b.UZ), points.T, strict=True):
        w[slot : slot + 3] = values
    tint_at(w, tint, (4, 4, 4))
    assert w[b.CODE] == w[b.CODE + 1]
    assert w[b.CODE + 2] == pytest.approx(63, abs=0.05)
