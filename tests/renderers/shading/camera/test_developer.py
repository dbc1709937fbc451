from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from numpy.typing import NDArray

from renderers.shading import CameraSettings
from renderers.shading.bands import RowBands
from renderers.shading.camera.developer import LEAST_ROWS, Developer
from renderers.shading.camera.optics import Optics, make_optics
from tests.renderers.shading.plain_camera import picture_of

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


def developed(camera: Developer, bands: RowBands, *seen: Any) -> NDArray[np.uint8]:
    picture, develop = camera.expose(*seen)
    bands.run(len(picture), develop, LEAST_ROWS)
    return picture


SETTINGS = {
    "full": FULL,
    "another": replace(
        FULL, focus_mm=5.0, defocus_px=3.0, contrast=1.3, saturation=0.8, knee=0.7
    ),
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
    got = developed(Developer(optics, bands, 1), bands, radiance, depth, 1.1, 5)
    expected = picture_of(optics, 1, radiance, depth, 1.1, 5)
    difference = np.abs(got.astype(int) - expected)
    assert difference.max() <= 1
    assert np.count_nonzero(difference) <= max(2, difference.size // 2000)


@pytest.fixture(scope="module")
def optics() -> Optics:
    return make_optics(wide(FULL, 300), LENS, 130, 300)


@pytest.mark.parametrize("threads", [2, 3])
def test_threads_and_bands_do_not_change_a_bit(optics: Optics, threads: int) -> None:
    radiance, depth = scene(300, 130)
    camera = Developer(optics, ALONE, 1)
    alone = developed(camera, ALONE, radiance, depth, 1.0, 2)
    bands = RowBands(threads)
    camera = Developer(optics, bands, 1)
    shared = developed(camera, bands, radiance, depth, 1.0, 2)
    bands.close()
    assert_array_equal(shared, alone)


def test_a_picture_leaves_nothing_for_the_next(optics: Optics) -> None:
    radiance, depth = scene(300, 130)
    camera = Developer(optics, ALONE, 1)
    first = developed(camera, ALONE, radiance, depth, 1.0, 2)
    developed(camera, ALONE, 10 * radiance[::-1], depth[::-1], 3.0, 7)
    assert_array_equal(developed(camera, ALONE, radiance, depth, 1.0, 2), first)


def test_a_failing_band_does_not_starve_the_next_picture(optics: Optics) -> None:
    radiance, depth = scene(300, 130)
    camera = Developer(optics, ALONE, 1)
    expected = developed(camera, ALONE, radiance, depth, 1.0, 2)
    no_number: Any = "2"
    for _ in range(2):
        with pytest.raises(TypeError):
            developed(camera, ALONE, radiance, depth, 1.0, no_number)
        with pytest.raises(Exception, match=r"(?i)type"):
            developed(camera, ALONE, radiance.astype(str), depth, 1.0, 2)
    assert_array_equal(developed(camera, ALONE, radiance, depth, 1.0, 2), expected)
