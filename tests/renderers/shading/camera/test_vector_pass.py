from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from numpy.typing import NDArray

from renderers.shading import CameraSettings
from renderers.shading.bands import RowBands
from renderers.shading.camera.optics import Optics, make_optics
from renderers.shading.camera.scalar_pass import StagedCamera
from renderers.shading.camera.vector_pass import SweptCamera

Floats = NDArray[np.float32]
FULL = CameraSettings()
LENS = 0.77
ALONE = RowBands(1)


def wide(settings: CameraSettings, size: int) -> CameraSettings:
    """Blur a small picture by as many pixels as one of 480."""
    grow = 480 / size
    return replace(
        settings,
        defocus_px=settings.defocus_px * grow,
        soft_px=settings.soft_px * grow,
        softer_px=settings.softer_px * grow,
        halo_px=settings.halo_px * grow,
        lateral=settings.lateral * grow,
    )


def scene(height: int, width: int) -> tuple[Floats, Floats]:
    """Give noise with glints before a slope from 1 to 40 mm, with empty pixels."""
    rng = np.random.default_rng(height)
    radiance = rng.gamma(0.5, 0.4, (height, width, 3)).astype(np.float32)
    radiance[height // 3 : height // 2] *= np.float32(0.1)
    depth = np.empty((height, width), np.float32)
    depth[:] = np.geomspace(40, 1, height)[:, None]
    depth[:, : width // 5] = np.inf
    return radiance, depth


SETTINGS = {
    "full": FULL,
    "without stop": replace(FULL, stop=False),
    "in focus": replace(FULL, defocus_px=0.0, stop=False),
    "without bloom": replace(FULL, glare=0.0, halo=0.0),
    "plain": CameraSettings.plain(),
}


@pytest.mark.parametrize("name", SETTINGS)
@pytest.mark.parametrize("size", [(72, 64), (51, 90), (33, 33), (8, 9)])
def test_it_makes_the_picture_of_the_plain_stages(
    size: tuple[int, int], name: str
) -> None:
    height, width = size
    optics = make_optics(wide(SETTINGS[name], min(size)), LENS, width, height)
    bands = RowBands(1)
    radiance, depth = scene(height, width)
    got = SweptCamera(optics, bands, 1).expose(radiance, depth, 1.1, 5).finish(bands)
    expected = (
        StagedCamera(optics, bands, 1).expose(radiance, depth, 1.1, 5).finish(bands)
    )
    difference = np.abs(got.astype(int) - expected)
    assert difference.max() <= 1
    assert np.count_nonzero(difference) <= max(2, difference.size // 2000)


@pytest.fixture(scope="module")
def optics() -> Optics:
    return make_optics(wide(FULL, 300), LENS, 130, 300)


@pytest.mark.parametrize("threads", [2, 3])
def test_threads_and_bands_do_not_change_a_bit(optics: Optics, threads: int) -> None:
    radiance, depth = scene(300, 130)
    alone = (
        SweptCamera(optics, RowBands(1), 1)
        .expose(radiance, depth, 1.0, 2)
        .finish(ALONE)
    )
    bands = RowBands(threads)
    shared = SweptCamera(optics, bands, 1).expose(radiance, depth, 1.0, 2).finish(bands)
    bands.close()
    assert_array_equal(shared, alone)


def test_a_picture_leaves_nothing_for_the_next(optics: Optics) -> None:
    radiance, depth = scene(300, 130)
    camera = SweptCamera(optics, RowBands(1), 1)
    first = camera.expose(radiance, depth, 1.0, 2).finish(ALONE)
    camera.expose(10 * radiance[::-1], depth[::-1], 3.0, 7).finish(ALONE)
    assert_array_equal(camera.expose(radiance, depth, 1.0, 2).finish(ALONE), first)


def test_a_failing_band_does_not_starve_the_next_picture(optics: Optics) -> None:
    radiance, depth = scene(300, 130)
    camera = SweptCamera(optics, RowBands(1), 1)
    expected = camera.expose(radiance, depth, 1.0, 2).finish(ALONE)
    no_number: Any = "2"
    for _ in range(2):
        with pytest.raises(TypeError):
            camera.expose(radiance, depth, 1.0, no_number).finish(ALONE)
        with pytest.raises(Exception, match=r"(?i)type"):
            camera.expose(radiance.astype(str), depth, 1.0, 2).finish(ALONE)
    assert_array_equal(camera.expose(radiance, depth, 1.0, 2).finish(ALONE), expected)
