import threading
import time

import numpy as np
import pytest
from numpy.typing import NDArray

from devices import DeviceError, DeviceReason, Pose
from devices.microscribe import MicroScribe
from devices.registration.held_point import HeldPoint, HoldError
from devices.registration.pivot import PivotError
from paravol.inputs.pose_sources import HomedSource
from paravol.registration.walk import PATIENCE_S, RegistrationWalk
from tests.devices.plugged_arm import RIGHT, Plug

LEFT = 2
HOLE = np.array([100.0, 50.0, 20.0])


class Hand:
    """A stylus that is put somewhere, with a foot on the pedals."""

    def __init__(self) -> None:
        self.poses: list[Pose] = []
        self.said: list[str] = []
        self.shown: list[tuple[str, float]] = []
        self._given = 0

    def put(self, frame: NDArray[np.float64], pedals: int) -> None:
        t_s = 0.01 * len(self.poses)
        self.poses.append(Pose(t_s, t_s, frame, pedals))

    def hold(self, place: NDArray[np.float64], pedals: int, seconds: float) -> None:
        frame = np.eye(4)
        frame[:3, 3] = place
        for _ in range(round(100 * seconds)):
            self.put(frame, pedals)

    def touch(self, *place: float) -> None:
        self.hold(np.array(place), RIGHT, 0.6)
        self.hold(np.array(place), 0, 0.2)

    def swing(self, half_deg: float, length_mm: float = 0.0) -> None:
        for i in range(300):
            tilt, around = np.radians(half_deg) * np.sqrt(i / 300), 0.3 * i
            z = np.array(
                [
                    np.sin(tilt) * np.cos(around),
                    np.sin(tilt) * np.sin(around),
                    np.cos(tilt),
                ]
            )
            x = np.cross((0.0, 1.0, 0.0), z)
            x /= np.linalg.norm(x)
            frame = np.eye(4)
            frame[:3, :3] = np.stack((x, np.cross(z, x), z), axis=1)
            frame[:3, 3] = HOLE + length_mm * z
            self.put(frame, RIGHT)
        self.hold(HOLE, 0, 0.2)

    def read(self, timeout_s: float) -> Pose:
        if self._given == len(self.poses):
            raise TimeoutError("the hand has done all it had to do")
        self._given += 1
        return self.poses[self._given - 1]

    def __call__(self, stage: str, share: float) -> None:
        self.shown.append((stage, share))

    def say(self, text: str) -> None:
        self.said.append(text)


@pytest.fixture
def hand() -> Hand:
    return Hand()


def _walk(hand: Hand) -> RegistrationWalk:
    return RegistrationWalk(hand, hand)


def test_landmarks_are_named_and_touched_in_order(hand: Hand) -> None:
    hand.touch(1, 2, 3)
    hand.touch(40, 5, 6)
    held = _walk(hand).touch(["nasion", "chin"])
    assert [point.tip_mm.tolist() for point in held] == [[1, 2, 3], [40, 5, 6]]
    assert [line for line in hand.said if "of 2" in line] == [
        "  1 of 2: nasion",
        "  2 of 2: chin",
    ]
    assert hand.shown[-1] == ("Touching the landmarks", 1.0)


def test_the_left_pedal_takes_the_last_one_back(hand: Hand) -> None:
    hand.touch(1, 2, 3)
    hand.hold(np.zeros(3), LEFT, 0.3)
    hand.hold(np.zeros(3), 0, 0.2)
    hand.touch(10, 20, 30)
    hand.touch(40, 5, 6)
    held = _walk(hand).touch(["nasion", "chin"])
    assert held[0].tip_mm.tolist() == [10, 20, 30]
    assert len(held) == 2


def test_a_slip_is_told_and_asked_for_again(hand: Hand) -> None:
    hand.hold(np.array([0.0, 0.0, 0.0]), RIGHT, 0.5)
    hand.hold(np.array([9.0, 0.0, 0.0]), RIGHT, 0.5)
    hand.hold(np.zeros(3), 0, 0.2)
    hand.touch(1, 2, 3)
    held = _walk(hand).touch(["nasion"])
    assert held[0].tip_mm.tolist() == [1, 2, 3]
    assert any("rest it in the hole" in line for line in hand.said)


def test_three_slips_are_enough(hand: Hand) -> None:
    for _ in range(3):
        hand.hold(np.zeros(3), RIGHT, 0.15)
        hand.hold(np.zeros(3), 0, 0.2)
    with pytest.raises(HoldError, match="too briefly"):
        _walk(hand).touch(["nasion"])


def test_the_calibrated_tip_is_used_from_then_on(hand: Hand) -> None:
    hand.swing(40.0, length_mm=14.0)
    frame = np.eye(4)
    frame[:3, 3] = (1.0, 2.0, 3.0 + 14.0)
    for pedal in [RIGHT] * 60 + [0] * 20:
        hand.put(frame, pedal)
    walk = _walk(hand)
    found = walk.pivot(along_axis=True)
    np.testing.assert_allclose(found.tip_mm, (0.0, 0.0, -14.0), atol=1e-9)
    held = walk.touch(["nasion"])
    np.testing.assert_allclose(held[0].tip_mm, (1.0, 2.0, 3.0), atol=1e-9)


def test_a_narrow_swing_is_asked_for_again(hand: Hand) -> None:
    hand.swing(3.0)
    hand.swing(40.0)
    _walk(hand).pivot(along_axis=False)
    assert any("tilt it further" in line for line in hand.said)
    for _ in range(3):
        hand.swing(3.0)
    with pytest.raises(PivotError):
        _walk(hand).pivot(along_axis=False)


def test_a_trace_is_thinned_and_may_be_continued(hand: Hand) -> None:
    for start in (0.0, 60.0):
        for i in range(400):
            hand.hold(np.array([start + 0.15 * i, 0.0, 0.0]), RIGHT, 0.01)
        hand.hold(np.zeros(3), 0, 0.2)
    traced = _walk(hand).trace()
    assert 60 <= len(traced) <= 81
    steps = np.linalg.norm(np.diff(traced, axis=0), axis=1)
    assert steps.min() >= 1.5 - 1e-9
    assert any("go on" in line for line in hand.said)


def test_nobody_there_is_said(hand: Hand) -> None:
    hand.hold(np.zeros(3), 0, PATIENCE_S + 1.0)
    with pytest.raises(TimeoutError, match="Nobody pressed"):
        _walk(hand).touch(["nasion"])


class Blinking(Hand):
    """A hand on an arm whose plug is pulled before some of its poses."""

    def __init__(self) -> None:
        super().__init__()
        self.gone_before: set[int] = set()

    def pull(self) -> None:
        self.gone_before.add(len(self.poses))

    def read(self, timeout_s: float) -> Pose:
        if self._given in self.gone_before:
            self.gone_before.remove(self._given)
            raise DeviceError(DeviceReason.DISCONNECTED, "The arm went away.")
        if timeout_s == 0.0:
            raise TimeoutError
        return super().read(timeout_s)


def test_a_blink_of_the_plug_loses_no_landmark() -> None:
    hand = Blinking()
    hand.touch(1, 2, 3)
    hand.pull()
    # back with the pedal down already: not this press, but the next
    hand.touch(50, 5, 6)
    hand.touch(40, 5, 6)
    hand.hold(np.array([7.0, 7, 7]), RIGHT, 0.3)
    hand.pull()
    hand.hold(np.array([90.0, 7, 7]), RIGHT, 0.8)
    hand.hold(np.zeros(3), 0, 0.2)
    hand.touch(7, 70, 7)
    held = _walk(hand).touch(["nasion", "chin", "ear"])
    places = [point.tip_mm.tolist() for point in held]
    assert places == [[1, 2, 3], [40, 5, 6], [7, 70, 7]]
    assert not hand.gone_before
    assert sum("What was measured is kept" in line for line in hand.said) == 2
    assert sum("The arm is back" in line for line in hand.said) == 2


def test_a_blink_of_the_plug_keeps_what_was_traced() -> None:
    hand = Blinking()
    for start in (0.0, 60.0, 120.0):
        for i in range(400):
            hand.hold(np.array([start + 0.15 * i, 0.0, 0.0]), RIGHT, 0.01)
            if start == 60.0 and i == 200:
                hand.pull()
        hand.hold(np.zeros(3), 0, 0.2)
    along = np.sort(_walk(hand).trace()[:, 0])
    assert along[0] < 60.0
    # nothing of the press during which it went
    assert not ((along > 60.0) & (along < 120.0)).any()


def test_an_arm_that_nobody_looks_for_fails_at_once(hand: Hand) -> None:
    def lost(timeout_s: float) -> Pose:
        raise DeviceError(DeviceReason.DISCONNECTED, "The arm went away.")

    hand.read = lost  # type: ignore[method-assign]
    with pytest.raises(DeviceError, match="went away"):
        _walk(hand).touch(["nasion"])


def test_the_drivers_arm_may_be_unplugged_between_two_landmarks(hand: Hand) -> None:
    plug = Plug()

    def person() -> None:
        time.sleep(0.3)
        plug.press()
        plug.move(False)
        time.sleep(0.3)
        plug.move(True)
        # pressed until somebody takes it
        while len(held) == 0:
            time.sleep(0.2)
            plug.press()

    held: list[HeldPoint] = []
    with MicroScribe(plug.line.open_port(), replug=plug) as arm:
        other = threading.Thread(target=person)
        other.start()
        held += RegistrationWalk(HomedSource(arm), hand).touch(["nasion", "chin"])
        other.join()
        losses = arm.counters["losses"]
    assert len(held) == 2
    assert losses == 1
    assert any("The arm is back" in line for line in hand.said)
