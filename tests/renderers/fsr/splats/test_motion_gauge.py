import numpy as np

from renderers.fsr.splats.motion_gauge import FAST_PX, MotionGauge
from renderers.fsr.splats.splat_mode import SplatMode
from renderers.scene import Camera


def turned(angle: float, size: tuple[int, int] = (200, 200)) -> Camera:
    target = (np.sin(angle), np.cos(angle), 0)
    return Camera.looking_at((0, 0, 0), target, size=size)


def test_a_fast_eye_gets_points_and_others_single_splats() -> None:
    gauge = MotionGauge(0.5)
    pixel = turned(0).radians_per_pixel
    angles = [0, 0, 0.5 * FAST_PX * pixel, 3 * FAST_PX * pixel, 3 * FAST_PX * pixel]
    modes = [gauge.mode(turned(angle)) for angle in angles]
    assert modes == [
        SplatMode.GAUSSIAN,
        SplatMode.GAUSSIAN,
        SplatMode.GAUSSIAN,
        SplatMode.POINTS,
        SplatMode.GAUSSIAN,
    ]


def test_motion_is_the_turn_in_pixels() -> None:
    gauge = MotionGauge(0.5)
    gauge.motion_px(turned(0))
    angle = 0.01
    wanted = angle / turned(0).radians_per_pixel
    assert abs(gauge.motion_px(turned(angle)) - wanted) < 1e-3 * wanted


def test_another_picture_size_starts_anew() -> None:
    gauge = MotionGauge(0.5)
    gauge.motion_px(turned(0))
    assert gauge.motion_px(turned(1, size=(100, 100))) == 0
