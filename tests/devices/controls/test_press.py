import numpy as np

from devices.controls.press import PressCollector
from devices.pose import Pose, PoseFlag


def _feed(pedals: list[int], flags: dict[int, PoseFlag] | None = None) -> list[int]:
    """Return the lengths of the presses in a row of pedals, 100 a second."""
    press = PressCollector(1)
    found = []
    for i, pedal in enumerate(pedals):
        flag = (flags or {}).get(i, PoseFlag.NONE)
        done = press.feed(Pose(0.01 * i, 0.01 * i, np.eye(4), pedal, flag))
        if done is not None:
            found.append(len(done))
    return found


def test_a_press_is_what_lies_between_the_edges() -> None:
    assert _feed([0] * 5 + [1] * 30 + [0] * 5) == [30]
    assert _feed(([0] * 5 + [1] * 20) * 3 + [0] * 5) == [20, 20, 20]


def test_chatter_belongs_to_the_press() -> None:
    assert _feed([1, 0, 1] + [1] * 20 + [0, 1, 0] + [0] * 5) == [23]


def test_a_short_press_is_chatter() -> None:
    assert _feed([0] * 5 + [1] * 5 + [0] * 20) == []


def test_other_pedals_do_not_matter() -> None:
    assert _feed([2] * 30 + [0] * 5) == []
    assert _feed([3] * 30 + [2] * 5) == [30]


def test_poses_that_may_be_wrong_are_left_out() -> None:
    flags = {10: PoseFlag.JUMP, 12: PoseFlag.SUSPECT}
    assert _feed([0] * 5 + [1] * 30 + [0] * 5, flags) == [28]
