import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from devices.pose import Pose, PoseFlag
from devices.registration.touch import TouchCollector


def _feed(
    touch: TouchCollector,
    pressed: list[bool],
    speed_mm: float = 0.0,
    flags: PoseFlag = PoseFlag.NONE,
) -> None:
    for i, down in enumerate(pressed):
        matrix = np.eye(4)
        matrix[0, 3] = 7.0 + speed_mm * i
        touch.feed(Pose(0.01 * i, 0.0, matrix, int(down), flags))


def test_a_press_gives_one_point() -> None:
    touch = TouchCollector()
    _feed(touch, [False] * 3 + [True] * 20 + [False] * 3)
    assert [p.tolist() for p in touch.points_mm] == [[7.0, 0.0, 0.0]]


@given(st.integers(1, 10))
def test_a_bounce_gives_none(samples: int) -> None:
    touch = TouchCollector()
    _feed(touch, [False] + [True] * samples + [False])
    assert not touch.points_mm


def test_a_slipping_stylus_gives_none_and_is_counted() -> None:
    touch = TouchCollector()
    _feed(touch, [True] * 20 + [False], speed_mm=1.0)
    assert not touch.points_mm
    assert touch.slipped == 1


def test_jumping_poses_do_not_count() -> None:
    touch = TouchCollector()
    _feed(touch, [True] * 20 + [False], flags=PoseFlag.JUMP)
    assert not touch.points_mm
