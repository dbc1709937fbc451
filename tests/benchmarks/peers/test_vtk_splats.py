"""VTK's splats are drawn in order, at our pixels, as wide as ours."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from benchmarks.peers.peer_process import PeerProcess
from benchmarks.plan import UnavailableError
from renderers.scene import Camera, Projection

pytestmark = pytest.mark.display

SIZE = 65
CAMERA = Camera.looking_at(
    (0, -50, 0), (0, 0, 0), extent=0.2, size=(SIZE, SIZE),
    projection=Projection.PERSPECTIVE,
)  # fmt: skip


@pytest.fixture(scope="module")
def peer() -> Iterator[PeerProcess]:
    process = PeerProcess("benchmarks.peers.vtk_splats")
    yield process
    process.close()


def draw(
    peer: PeerProcess, points: list[list[float]], rgba: list[list[int]], sigma_mm: float
) -> NDArray[np.float32]:
    try:
        job: dict[str, Any] = {
            "points": peer.store(np.array(points, np.float32)),
            "rgba": peer.store(np.array(rgba, np.uint8)),
            "sigma_mm": sigma_mm,
            "frame": CAMERA.frame.tolist(),
            "extent": CAMERA.extent,
            "size": SIZE,
            "near_mm": 0.2,
            "far_mm": 200.0,
            "budget_s": 0.0,
        }
        return peer.picture(peer.ask(job))
    except UnavailableError as error:
        pytest.skip(str(error))


@pytest.mark.parametrize("swapped", [False, True])
def test_the_nearer_splat_is_in_front_whatever_comes_first(
    peer: PeerProcess, swapped: bool
) -> None:
    points, rgba = [[0, -5, 0], [0, 5, 0]], [[255, 0, 0, 204], [0, 255, 0, 204]]
    if swapped:
        points, rgba = points[::-1], rgba[::-1]
    picture = draw(peer, [[float(v) for v in p] for p in points], rgba, 2.0)
    middle = picture[SIZE // 2, SIZE // 2]
    # red .8 over green .8 * .2
    assert middle == pytest.approx([0.8, 0.16, 0.0], abs=0.02)


def test_a_splat_is_a_gaussian_at_the_projected_place(peer: PeerProcess) -> None:
    place, sigma_mm = np.array([2.0, 0.0, 3.0]), 1.5
    picture = draw(peer, [place.tolist()], [[255, 255, 255, 255]], sigma_mm)[..., 0]
    pixel, _ = CAMERA.project(place)
    row, column = np.indices((SIZE, SIZE)) + 0.5
    mass = picture.sum()
    assert np.sum(picture * column) / mass == pytest.approx(pixel[0], abs=0.2)
    assert np.sum(picture * row) / mass == pytest.approx(pixel[1], abs=0.2)
    sigma_px = sigma_mm / 50 * (SIZE / 2) / np.tan(CAMERA.extent)
    r2 = (column - pixel[0]) ** 2 + (row - pixel[1]) ** 2
    wanted = np.exp(-0.5 * r2 / sigma_px**2)
    assert np.abs(picture - wanted)[r2 < 6 * sigma_px**2].max() < 0.03
