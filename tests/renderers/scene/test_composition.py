"""Several solids in one view."""

import math

import numpy as np
from numpy.testing import assert_array_equal

from renderers.scene import Camera, GBuffer, Material
from renderers.scene.composition import solids_seen
from tests.tools import board

CAMERA = Camera.looking_at(
    (1, -30, 2), (0, 0, 0), extent=math.radians(20), size=(40, 32)
)


def test_the_nearest_of_several_solids_is_seen_in_any_order() -> None:
    near, far = board(CAMERA, 10.0, 1.0), board(CAMERA, 20.0, 6.0)
    one, other = solids_seen(CAMERA, [near, far]), solids_seen(CAMERA, [far, near])
    alone = [mesh.gbuffer(CAMERA, pose) for mesh, pose in (near, far)]
    merged = alone[0].nearest(alone[1])
    for name in ("depth_mm", "normal", "coverage", "material"):
        assert_array_equal(getattr(one, name), getattr(other, name))
        assert_array_equal(getattr(one, name), getattr(merged, name))
    seen = one.coverage > 0
    assert_array_equal(np.unique(one.material[seen]), [Material.DARK_PLASTIC])
    close = one.depth_mm < 15
    assert 0 < close.sum() < seen.sum() < seen.size


def test_nothing_placed_is_nothing_seen() -> None:
    found, none = solids_seen(CAMERA, []), GBuffer.empty(32, 40)
    assert_array_equal(found.depth_mm, none.depth_mm)
    assert not found.coverage.any()
