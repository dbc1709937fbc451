import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal
from numpy.typing import NDArray

from renderers.scene import Camera, GBuffer, Projection, srgb_from_linear
from renderers.scene.thread_pool import ThreadPool
from renderers.shading import CameraPass, CameraSettings

SIZE = 72


@pytest.fixture(scope="module")
def view() -> Camera:
    return Camera.looking_at((0, 0, 0), (0, 10, 0), size=(SIZE, SIZE))


@pytest.fixture(scope="module")
def depths() -> GBuffer:
    buffer = GBuffer.empty(SIZE, SIZE)
    buffer.depth_mm[:, : SIZE // 2] = np.linspace(1, 40, SIZE // 2)
    buffer.coverage[:, : SIZE // 2] = 1
    return buffer


@pytest.fixture(scope="module")
def radiance() -> NDArray[np.float32]:
    rng = np.random.default_rng(2)
    picture = rng.gamma(0.5, 0.01, (SIZE, SIZE, 3)).astype(np.float32)
    picture[30:33, 40:43] = 5.0
    return picture


def flat(value: float) -> NDArray[np.float32]:
    return np.full((SIZE, SIZE, 3), value, np.float32)


@pytest.fixture(scope="module")
def plain() -> CameraPass:
    return CameraPass(CameraSettings.plain(), threads=1)


@given(value=st.floats(0, 1.2))
def test_a_plain_camera_only_encodes(
    plain: CameraPass, view: Camera, depths: GBuffer, value: float
) -> None:
    picture, gain = plain.finish(flat(value), depths, view, gain=1.0)
    expected = 255 * float(srgb_from_linear(np.array(value)))
    assert gain == 1.0
    assert np.all(picture == picture[0, 0])
    assert abs(float(picture[0, 0, 0]) - expected) <= 0.501


def test_it_exposes_by_itself(plain: CameraPass, view: Camera, depths: GBuffer) -> None:
    picture, gain = plain.finish(flat(0.002), depths, view)
    assert gain * 0.002 == pytest.approx(0.17, rel=1e-4)
    expected = 255 * float(srgb_from_linear(np.array(0.17)))
    assert abs(float(picture[36, 36, 1]) - expected) <= 0.51


@pytest.mark.parametrize("threads", [1, 2, 3])
def test_a_picture_begun_is_the_picture_finished(
    view: Camera, depths: GBuffer, radiance: NDArray[np.float32], threads: int
) -> None:
    """Whatever else the threads do meanwhile; one after the other."""
    alone = CameraPass(threads=1)
    pool = ThreadPool(threads)
    camera = CameraPass(threads=pool)
    for number in range(5):
        begun = camera.begin(
            radiance, depths, view, gain=1.0, frame_number=number, then=np.copy
        )
        assert pool.map(abs, range(-9, 0)) == list(range(9, 0, -1))
        expected, _ = alone.finish(
            radiance, depths, view, gain=1.0, frame_number=number
        )
        assert_array_equal(begun.result(), expected)
    pool.close()


def test_outside_the_stop_all_is_black(view: Camera, depths: GBuffer) -> None:
    picture, _ = CameraPass(threads=1).finish(flat(1.0), depths, view, gain=1.0)
    y, x = np.indices((SIZE, SIZE)) - (SIZE - 1) / 2
    r = np.hypot(x, y)
    assert not picture[r >= SIZE / 2].any()
    assert np.all(picture[r < SIZE / 2 - 4][:, 0] > 0)


def test_the_notch_is_at_the_top(view: Camera, depths: GBuffer) -> None:
    settings = replace(CameraSettings.plain(), stop=True)
    picture, _ = CameraPass(settings, 1).finish(flat(1.0), depths, view, gain=1.0)
    # the stop is symmetric but for the notch
    difference = picture.astype(int) - picture[::-1].astype(int)
    rows, columns = np.nonzero(difference[..., 0] < 0)
    assert len(rows) > 0
    assert rows.max() < 5
    assert np.abs(columns - (SIZE - 1) / 2).max() < 5


def test_grain_belongs_to_the_frame_number(
    view: Camera, depths: GBuffer, radiance: NDArray[np.float32]
) -> None:
    camera_pass = CameraPass(threads=1)
    frames = [
        camera_pass.finish(radiance, depths, view, gain=9.0, frame_number=n)[0]
        for n in (4, 5, 4)
    ]
    assert_array_equal(frames[0], frames[2])
    assert not np.array_equal(frames[0], frames[1])


def test_grain_has_the_set_deviation(view: Camera, depths: GBuffer) -> None:
    settings = replace(CameraSettings.plain(), noise=0.02)
    value = 0.2
    picture, _ = CameraPass(settings, 1).finish(flat(value), depths, view, gain=1.0)
    slope = 1.055 / 2.4 * value ** (1 / 2.4 - 1)
    expected = 255 * slope * 0.02 * math.sqrt(0.15 + value)
    assert float(picture.std()) == pytest.approx(expected, rel=0.1)


def test_the_vignette_is_the_cosines_power(view: Camera, depths: GBuffer) -> None:
    settings = replace(CameraSettings.plain(), vignette=1.5)
    picture, _ = CameraPass(settings, 1).finish(flat(0.5), depths, view, gain=1.0)
    r = np.abs(np.arange(SIZE) - (SIZE - 1) / 2) / (SIZE / 2)
    centre = 0.5 * (1 / SIZE) * 2
    theta = np.hypot(r, centre) * view.extent
    expected = 255 * srgb_from_linear(0.5 * np.cos(0.9 * theta) ** 1.5)
    np.testing.assert_allclose(picture[SIZE // 2, :, 0], expected, atol=0.51)


def test_the_tone_curve_is_monotone_and_keeps_grey_grey(
    view: Camera, depths: GBuffer
) -> None:
    settings = replace(
        CameraSettings.plain(), contrast=1.12, saturation=1.15, knee=0.55, keep_hue=0.4
    )
    picture = flat(0)
    ramp = np.linspace(0, 6, SIZE, dtype=np.float32)
    picture[:] = ramp[None, :, None]
    got, _ = CameraPass(settings, 1).finish(picture, depths, view, gain=1.0)
    assert np.all(np.diff(got[0, :, 0].astype(int)) >= 0)
    assert np.all(got[..., 0] == got[..., 2])
    # the shoulder of the formula
    c = 0.18 * (ramp / 0.18) ** 1.12
    over = np.maximum(c - 0.55, 0) / 0.45
    bent = np.where(c > 0.55, 0.55 + 0.45 * over / (1 + over), c)
    np.testing.assert_allclose(got[0, :, 1], 255 * srgb_from_linear(bent), atol=0.52)


def test_a_near_wall_keeps_its_shading(view: Camera, depths: GBuffer) -> None:
    """Red tissue over white does not clip, and a third less light is seen."""
    picture = flat(0)
    picture[:, : SIZE // 2] = 2.4 * np.array([1, 0.4, 0.4], np.float32)
    picture[:, SIZE // 2 :] = 1.6 * np.array([1, 0.4, 0.4], np.float32)
    settings = replace(
        CameraSettings(), noise=0, glare=0, halo=0, stop=False, vignette=0, defocus_px=0
    )
    got, _ = CameraPass(settings, 1).finish(picture, depths, view, gain=1.0)
    near, far = (got[10, x].astype(int) for x in (10, SIZE - 10))
    assert near[0] < 250
    assert (near >= far + 3).all()


def test_inputs_are_only_read(
    view: Camera, depths: GBuffer, radiance: NDArray[np.float32]
) -> None:
    before = radiance.copy(), depths.depth_mm.copy()
    CameraPass(threads=1).finish(radiance, depths, view)
    assert_array_equal(radiance, before[0])
    assert_array_equal(depths.depth_mm, before[1])


def test_pictures_need_not_be_square() -> None:
    camera = Camera.looking_at((0, 0, 0), (0, 9, 0), size=(90, 50))
    picture, _ = CameraPass(threads=1).finish(
        np.full((50, 90, 3), 0.1, np.float32), GBuffer.empty(50, 90), camera
    )
    assert picture.shape == (50, 90, 3)
    assert not picture[:, :19].any()
    assert picture[25, 45].all()


def test_what_does_not_fit_is_refused(
    plain: CameraPass, view: Camera, depths: GBuffer
) -> None:
    with pytest.raises(ValueError, match="radiance must be float32"):
        plain.finish(np.zeros((3, 3, 3), np.float32), depths, view)
    with pytest.raises(ValueError, match="gain is positive"):
        plain.finish(flat(1), depths, view, gain=0.0)
    with pytest.raises(ValueError, match="does not fit a camera"):
        plain.finish(flat(1), GBuffer.empty(8, 8), view)
    pinhole = replace(view, projection=Projection.PERSPECTIVE)
    with pytest.raises(ValueError, match=r"equidistant.*perspective"):
        plain.finish(flat(1), depths, pinhole)
