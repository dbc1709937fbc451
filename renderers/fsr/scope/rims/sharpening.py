"""Rims of a splatted picture made as sharp as the surface."""

import numpy as np

from renderers.fsr.scope.rims.kernels import sharpen
from renderers.scene import Camera, GBuffer, Volume
from renderers.scene.thread_team import ThreadTeam

PARTS_PER_THREAD = 4
"""Rims lie unevenly over the rows."""


def sharpen_rims(
    distance: Volume, camera: Camera, team: ThreadTeam, result: GBuffer
) -> tuple[int, int]:
    """Take discs away where they stand over a free edge; change `result` in place.

    distance: signed, mm, whose zero set the discs cover. Returns how many pixels' rays
    were followed and how many went to another wall; they may count a pixel twice where
    threads meet, but the bits do not depend on the team's size.
    """
    voxel_from_world = distance.voxel_from_world
    eye = voxel_from_world[:3, :3] @ camera.eye_mm + voxel_from_world[:3, 3]
    height, width = result.size
    state = np.zeros(height * width, np.uint8)
    parts = PARTS_PER_THREAD * team.threads if team.threads > 1 else 1
    edges = [height * part // parts for part in range(parts + 1)]

    def sharpen_rows(part: int) -> tuple[int, int]:
        asked, moved = sharpen(
            distance.values,
            voxel_from_world[:3, :3].astype(np.float32),
            eye.astype(np.float32),
            camera.frame[1:].astype(np.float32),
            camera.lens_table(),
            edges[part],
            edges[part + 1],
            np.empty(height * width, np.int32),
            state,
            result.depth_mm,
            result.normal,
        )
        return asked, moved

    totals = team.map(sharpen_rows, range(parts))
    return sum(t[0] for t in totals), sum(t[1] for t in totals)
