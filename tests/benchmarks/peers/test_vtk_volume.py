"""VTK's ray casters, and yt's, draw the same scene through the same camera."""

from collections.abc import Iterator

import numpy as np
import pytest
from numpy.typing import NDArray

from benchmarks.peers.peer_jobs import VolumeJobs
from benchmarks.peers.peer_process import PeerProcess
from benchmarks.plan import UnavailableError
from benchmarks.references import rgb_over_black
from renderers.art import ActiveRayTracer
from renderers.scene import (
    Camera,
    PhongMaterial,
    Projection,
    Scene,
    TransferFunction,
    Volume,
)

pytestmark = pytest.mark.display

SIZE = 128
VTK = ["vtk_volume", "vtk_gpu_volume"]


def solid(center_mm: tuple[float, float, float], kappa: float) -> Scene:
    """Give a lopsided solid: two balls, so that no mirroring goes unseen."""
    axis = np.arange(41.0) - 20
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij")
    a, b, c = center_mm
    big = 9 - np.sqrt((x - a) ** 2 + (y - b) ** 2 + (z - c) ** 2)
    small = 4 - np.sqrt((x - a - 9) ** 2 + (y - b) ** 2 + (z - c - 9) ** 2)
    hu = np.clip(200 * np.maximum(big, small), -1000, 1000).astype(np.int16)
    transfer = TransferFunction(
        np.array([-1000.0, -50.0, 50.0, 1000.0]),
        np.full((4, 3), 0.8),
        np.array([0.0, 0.0, kappa, kappa]),
    )
    volume = Volume(hu, np.ones(3), np.full(3, -20.0))
    plain = PhongMaterial(ambient=1.0, diffuse=0.0)
    return Scene(volume, transfer, lights=(), material=plain)


@pytest.fixture(scope="module", params=VTK)
def peer(request: pytest.FixtureRequest) -> Iterator[PeerProcess]:
    process = PeerProcess(f"benchmarks.peers.{request.param}")
    yield process
    process.close()


def both(
    peer: PeerProcess, scene: Scene, camera: Camera
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Draw one view by the peer and by us; the brightest channel."""
    try:
        job = VolumeJobs(peer, scene).job(camera, 0.25, shaded=False, budget_s=0.0)
        answer = peer.ask(job)
    except UnavailableError as error:
        pytest.skip(str(error))
    assert answer.timing.cpu_s > 0
    own = ActiveRayTracer(scene, "final", threads=1).render(camera)
    return peer.picture(answer)[..., 0], rgb_over_black(own.rgba)[..., 0]


@pytest.mark.parametrize("eye", [(0.0, -70.0, 5.0), (60.0, -30.0, -20.0)])
def test_silhouettes_agree_within_a_pixel(
    peer: PeerProcess, eye: tuple[float, float, float]
) -> None:
    camera = Camera.looking_at(
        eye, (2, 1, 3), extent=0.3, size=(SIZE, SIZE), projection=Projection.PERSPECTIVE
    )
    theirs, ours = both(peer, solid((-2.0, 0.0, -2.0), 20.0), camera)
    a, b = theirs > 0.4, ours > 0.4
    assert a.sum() > 1000
    near_b = np.zeros_like(b)
    near_a = np.zeros_like(a)
    for row in (-1, 0, 1):
        for column in (-1, 0, 1):
            near_b |= np.roll(b, (row, column), (0, 1))
            near_a |= np.roll(a, (row, column), (0, 1))
    assert not np.any(a & ~near_b)
    assert not np.any(b & ~near_a)
    for axis in (0, 1):
        along = np.arange(SIZE) + 0.5
        shift = [float(m.sum(axis=1 - axis) @ along / m.sum()) for m in (theirs, ours)]
        assert abs(shift[0] - shift[1]) < 0.2


# yt absorbs as much as a step is long: nothing that is opaque in a step
@pytest.mark.parametrize("peer", [*VTK, "yt_volume"], indirect=True)
def test_half_clear_matter_is_as_opaque_there_as_here(peer: PeerProcess) -> None:
    camera = Camera.looking_at(
        (0, -70, 5), (0, 0, 0), extent=0.3, size=(SIZE, SIZE),
        projection=Projection.PERSPECTIVE,
    )  # fmt: skip
    theirs, ours = both(peer, solid((0.0, 0.0, 0.0), 0.05), camera)
    middle = (slice(SIZE // 2 - 8, SIZE // 2 + 8),) * 2
    assert 0.3 < ours[middle].mean() < 0.7
    # two codes: tables of 15 bits, read back as 8
    assert np.abs(theirs[middle] - ours[middle]).max() < 2.5 / 255


@pytest.mark.parametrize("forward", [(0, 1, 0), (0, -1, 0)])
def test_the_eye_may_be_inside_with_the_centre_behind(
    peer: PeerProcess, forward: tuple[float, float, float]
) -> None:
    camera = Camera.looking_at(
        (0, 12, 0), (0, 12 + 9 * forward[1], 2), extent=0.7, size=(SIZE, SIZE),
        projection=Projection.PERSPECTIVE,
    )  # fmt: skip
    scene = solid((0.0, 0.0 if forward[1] < 0 else 25.0, 0.0), 20.0)
    theirs, ours = both(peer, scene, camera)
    assert (ours > 0.4).any()
    assert np.mean((theirs > 0.4) != (ours > 0.4)) < 0.02
