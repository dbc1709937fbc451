"""A number for each pixel: can a wall be missing here, or have a hole that is none?

The renderers draw the zero set of a sampled distance, read between samples by trilinear
interpolation. Let a flat wall of thickness w have the distance ``w / 2 - |u|``, u from
its middle. A trilinear mean of that is below it by at most the mean of ``|u|`` over the
weights, which is at most their standard deviation, at most half the largest spacing s.
Hence, whatever the wall's direction:

- a wall with ``w >= s`` is never lost; a thinner one may be, wholly or in part;
- where it is drawn, it is drawn no thicker than it is;
- where it is lost, the field in its middle is still above ``-s / 2``.

So a pixel is sure (1) where the wall that it shows gets at least s / 2 deep close
behind its surface, and where its ray comes past no place of the air that stands out
with more than ``-s / 2``. What is less is that depth, or how far below zero that place
is, over s / 2, whichever is smaller: 0 is least sure. The edge of anything that a ray
passes within s / 2 is marked, too.

It knows only what was sampled: bone that was lost before the distance was made, by a
threshold on a scan, leaves no trace here.
"""

import numpy as np
from numpy.typing import NDArray

from renderers.art.kernels.rate_walls import rate_rows
from renderers.scene import Camera, Volume
from renderers.shading.bands import RowBands

FARTHEST_MM = 200.0
"""Rays that meet nothing are followed so far: through any head."""


def wall_confidence(
    distance: Volume,
    camera: Camera,
    depth_mm: NDArray[np.float32],
    *,
    threads: int = 2,
) -> NDArray[np.float32]:
    """Rate each pixel from 0 to 1, ``(h, w)`` float32; 1 where nothing is seen.

    distance: mm, negative in air. depth_mm: ``(h, w)`` of the picture, along the rays,
    +inf where they meet nothing. The same bits for any number of threads.
    """
    if depth_mm.shape != (camera.height, camera.width):
        raise ValueError(
            f"depth of {depth_mm.shape} does not fit a camera of "
            f"{(camera.height, camera.width)} (height, width)"
        )
    matrix = distance.voxel_from_world
    origins, rays = camera.rays()
    eyes = (origins @ matrix[:3, :3].T + matrix[:3, 3]).astype(np.float32)
    confidence = np.ones(depth_mm.shape, np.float32)
    bands = RowBands(threads)

    def rows(first: int, last: int) -> None:
        rate_rows(
            distance.values,
            matrix[:3, :3].astype(np.float32),
            eyes,
            rays.astype(np.float32),
            np.ascontiguousarray(depth_mm),
            np.float32(distance.spacing_mm.max()),
            np.float32(FARTHEST_MM),
            confidence,
            first,
            last,
        )

    try:
        bands.run(camera.height, rows)
    finally:
        bands.close()
    return confidence
