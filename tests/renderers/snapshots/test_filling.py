import numpy as np
import pytest

from renderers.scene import Camera, GBuffer
from renderers.snapshots.filling import fill


@pytest.mark.parametrize("size", [(50, 43), (43, 50), (37, 37), (101, 8)])
def test_coarse_pixels_lie_where_the_fine_ones_do(
    size: tuple[int, int], outside: Camera
) -> None:
    """A coarse picture of where its rays go differs from the fine by half a pixel."""
    width, height = size
    fine, rough = (
        GBuffer.empty(h, w)
        for w, h in ((width, height), (-(-width // 4), -(-height // 4)))
    )
    for buffer in (fine, rough):
        h, w = buffer.size
        table = outside.with_size(w, h).lens_table()
        buffer.normal[:] = table / table[..., 2:]
    nothing = np.zeros((height, width), bool)
    found = fill(fine, nothing, rough)
    assert isinstance(found, GBuffer)
    off = np.abs(found.normal - fine.normal)[..., :2]
    pixel = 2 * np.tan(outside.extent) / min(rough.size)
    # beyond the coarse picture's own edge its outermost pixels stand
    assert np.percentile(off, 90) <= 0.51 * pixel
    assert off.max() <= 1.01 * pixel
