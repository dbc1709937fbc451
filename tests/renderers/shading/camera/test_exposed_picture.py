"""What is begun is what is finished, and what fails at its end is told."""

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from numpy.typing import NDArray

from renderers.shading import CameraSettings
from renderers.shading.bands import RowBands
from renderers.shading.camera.exposed_picture import ExposedPicture
from renderers.shading.camera.optics import Optics, make_optics
from renderers.shading.camera.scalar_pass import StagedCamera
from renderers.shading.camera.vector_pass import SweptCamera

SIZE = 120, 130
ALONE = RowBands(1)


@pytest.fixture(scope="module")
def optics() -> Optics:
    return make_optics(CameraSettings(), 0.77, SIZE[1], SIZE[0])


@pytest.fixture(scope="module")
def seen() -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    rng = np.random.default_rng(3)
    radiance = rng.gamma(0.5, 0.4, (*SIZE, 3)).astype(np.float32)
    return radiance, np.full(SIZE, 7.0, np.float32)


@pytest.mark.parametrize("kind", [SweptCamera, StagedCamera])
@pytest.mark.parametrize("threads", [1, 2, 3])
def test_a_picture_begun_is_the_picture_finished(
    optics: Optics,
    seen: tuple[NDArray[np.float32], NDArray[np.float32]],
    kind: Any,
    threads: int,
) -> None:
    """Whatever else the threads do meanwhile; one after the other."""
    alone = kind(optics, ALONE, 1)
    bands = RowBands(threads)
    camera = kind(optics, bands, 1)
    for number in range(5):
        begun = camera.expose(*seen, 1.0, number).begin(bands, np.copy)
        assert bands.team.map(abs, range(-9, 0)) == list(range(9, 0, -1))
        expected = alone.expose(*seen, 1.0, number).finish(ALONE)
        assert_array_equal(begun.result(), expected)
    bands.close()


@pytest.mark.parametrize("threads", [1, 2])
def test_every_row_is_developed_once(threads: int) -> None:
    bands = RowBands(threads)
    for height in (1, 2, 3, 50):
        pixels = np.zeros((height, 4, 3), np.uint8)

        def develop(first: int, last: int, pixels: NDArray[np.uint8] = pixels) -> None:
            pixels[first:last] += 1

        picture = ExposedPicture(pixels, develop)
        assert (picture.begin(bands, np.copy).result() == 1).all()
        assert (picture.finish(bands) == 2).all()
    bands.close()


@pytest.mark.parametrize("threads", [1, 2])
def test_what_fails_is_raised_by_the_errand(threads: int) -> None:
    bands = RowBands(threads)
    pixels = np.zeros((8, 4, 3), np.uint8)

    def fail(*_: object) -> None:
        raise OSError("the disk is full")

    for picture, then in (
        (ExposedPicture(pixels, lambda first, last: None), fail),
        (ExposedPicture(pixels, fail), np.copy),
    ):
        with pytest.raises(OSError, match="disk is full"):
            picture.begin(bands, then).result()
    bands.close()
