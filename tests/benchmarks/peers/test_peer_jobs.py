"""The peer is given our scene, not one like it."""

import numpy as np
import pytest

from anatomy import bone_transfer_function, classic_transfer_function
from benchmarks.peers.peer_jobs import dense_table, view_job
from benchmarks.peers.peer_process import PeerProcess
from benchmarks.scenes import SubjectSource
from renderers.scene import Camera, Projection


def test_the_dense_table_is_the_transfer_function() -> None:
    for transfer in (classic_transfer_function(), bone_transfer_function()):
        table = dense_table(transfer)
        assert np.isin(transfer.nodes, table[:, 0]).all()
        density = np.random.default_rng(1).uniform(-1200, 1700, 500)
        color, kappa = transfer.evaluate(density)
        assert np.allclose(np.interp(density, table[:, 0], table[:, 4]), kappa)
        for c in range(3):
            found = np.interp(density, table[:, 0], table[:, 1 + c])
            assert np.allclose(found, color[:, c])


def test_peers_are_given_only_what_they_can_draw(ball: SubjectSource) -> None:
    scene = ball.subject.scene
    for camera in (
        Camera.looking_at((0, -50, 0), (0, 0, 0), size=(32, 32)),
        Camera.looking_at(
            (0, -50, 0), (0, 0, 0), size=(32, 16), projection=Projection.PERSPECTIVE
        ),
    ):
        with pytest.raises(ValueError, match="square perspective"):
            view_job(camera, scene, 1.0)
    assert PeerProcess("benchmarks.peers.vtk_splats")._child is None
