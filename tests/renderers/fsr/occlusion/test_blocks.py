import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from renderers.fsr.occlusion.kernels import trace_cones
from renderers.fsr.thread_team import ThreadTeam
from renderers.scene import Camera, Projection, Volume


@pytest.mark.parametrize("projection", [Projection.EQUIDISTANT, Projection.PERSPECTIVE])
@settings(max_examples=10)
@given(
    x=st.floats(-9, -4), y=st.floats(-2, 2), z=st.floats(-2, 2), turn=st.floats(0, 6)
)
def test_every_ray_of_a_square_meets_tissue_before_the_square_ends(
    cavities: Volume,
    team: ThreadTeam,
    projection: Projection,
    x: float,
    y: float,
    z: float,
    turn: float,
) -> None:
    camera = Camera.looking_at(
        (x, y, z),
        (x + np.cos(turn), y + np.sin(turn), z + 0.1),
        size=(32, 32),
        projection=projection,
    )
    camera_from_world = np.eye(4)
    camera_from_world[:3, :3] = camera.frame[1:]
    camera_from_world[:3, 3] = -camera.frame[1:] @ camera.eye_mm
    voxel_from_camera = np.linalg.inv(camera_from_world @ cavities.world_from_voxel)
    ends = np.empty((8, 8), np.float32)
    nz, ny, nx = cavities.shape
    trace_cones(
        cavities.values.reshape(-1),
        nx,
        ny,
        nz,
        np.asarray(voxel_from_camera, np.float64),
        int(projection),
        camera.extent,
        32,
        32,
        4,
        0.125,
        0,
        8,
        ends,
    )
    origin, ray = camera.rays()
    seen = np.any(ray != 0, axis=-1)
    t = np.arange(0.1, 22, 0.1)
    points = origin[seen][:, None, :] + t[:, None] * ray[seen][:, None, :]
    tissue = cavities.sample(points) > 0
    first = np.where(tissue.any(axis=-1), t[np.argmax(tissue, axis=-1)], np.inf)
    limit = np.repeat(np.repeat(ends, 4, axis=0), 4, axis=1)
    assert np.all(first <= limit[seen] + 0.1)
    assert np.isfinite(limit[seen]).any()
