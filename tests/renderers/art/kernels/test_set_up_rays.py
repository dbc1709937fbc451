"""Rays set up on vectors against the scalar function, bit by bit."""

import numpy as np
import pytest

from renderers.art.kernels.build_bricks import set_up_rays as scalar
from renderers.art.kernels.set_up_rays import set_up_rays
from renderers.scene import Camera, Projection, Scene


@pytest.mark.parametrize("projection", list(Projection))
@pytest.mark.parametrize("at_ends", [False, True])
def test_rays(scene: Scene, projection: Projection, at_ends: bool) -> None:
    """Some rays miss, some run along an axis; 7 x 13 is no whole number of packets."""
    volume = scene.volume
    centre = volume.center_mm
    extent = 14.0 if projection is Projection.ORTHOGRAPHIC else 0.8
    for eye in (centre, centre + 25 * volume.direction[:, 1]):
        camera = Camera.looking_at(
            eye,
            eye - volume.direction[:, 1],
            extent=extent,
            size=(7, 13),
            projection=projection,
        )
        results = []
        # Some rays end within the volume, some before it, the rest nowhere.
        limit = np.full(91, np.inf, np.float32)
        limit[::3] = np.linspace(0, 60, len(limit[::3]))
        for function in (scalar, set_up_rays):
            geometry, count = np.zeros((91, 8), np.float32), np.zeros(91, np.int32)
            function(
                camera.lens_table().reshape(-1, 3).copy(),
                limit,
                0,
                camera.frame.copy(),
                projection is Projection.ORTHOGRAPHIC,
                np.array(volume.voxel_from_world),
                np.array(volume.shape[::-1]) - 1.0,
                0.2,
                at_ends,
                geometry,
                count,
            )
            results.append((geometry.tobytes(), count.tolist()))
        assert results[0] == results[1]
        assert max(results[0][1]) > 20
