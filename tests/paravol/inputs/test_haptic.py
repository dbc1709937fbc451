"""What steers is felt: the pose that is flown is the force device's."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from devices import DeviceError, DeviceReason, Pose, ProbePath
from devices.haptics.mock_head import HeadFault
from devices.pose import PoseFlag
from paravol.inputs.flight_input import FlightInput, framed_hand, in_the_patient
from paravol.inputs.hand import MouseInput
from paravol.inputs.haptic import EmulatedHapticInput, FeltPoses, felt_input
from paravol.inputs.pose_sources import OrderedPoses
from paravol.inputs.recording import RecordedSamples
from paravol.patient import PatientScene
from scenarios import Sample, Scenario
from system import UserError
from tests.paravol.haptics.simulated_loop import FLOOR_MM, RADIUS_MM, floor, place

Exercise = tuple[Scenario, ProbePath]

SCOPE_MM = RADIUS_MM


@dataclass
class Goals:
    """A hand that goes where a test wants it, 100 times a second."""

    pose: np.ndarray
    number: int = 0
    buttons: int = 0
    pause: threading.Event = field(default_factory=threading.Event)

    def read(self, timeout_s: float) -> Pose:
        self.pause.wait(0.01)
        self.number += 1
        time_s = self.number / 100
        return Pose(time_s, time_s, self.pose, self.buttons, PoseFlag.NONE)


class GoalInput(FlightInput):
    """The hand as an input."""

    def __init__(self, goals: Goals) -> None:
        self.goals = goals
        self.name = "goals"
        self.keys = {"g": "go"}
        self.completer = framed_hand()
        self.registration = in_the_patient()

    @contextmanager
    def open(self, patient: PatientScene) -> Iterator[Goals]:
        yield self.goals


def goal_input(fault: str | None = None) -> tuple[EmulatedHapticInput, Goals]:
    goals = Goals(place(3.0))
    suffers = HeadFault() if fault is None else HeadFault.parse(fault)
    felt = EmulatedHapticInput(GoalInput(goals), suffers, SCOPE_MM)
    felt.operated(floor())
    return felt, goals


def height_of(pose: Pose) -> float:
    return float(pose.tip_mm[2] - FLOOR_MM)


def read_many(source: OrderedPoses, count: int) -> list[Pose]:
    return [source.read(0.5) for _ in range(count)]


def test_a_hand_inside_tissue_is_flown_where_the_force_holds_it(
    bare_room: PatientScene,
) -> None:
    felt, goals = goal_input()
    before = set(threading.enumerate())
    with felt.open(bare_room) as source:
        assert isinstance(source, FeltPoses)
        first = source.read(5.0)
        # what registers is the hand's device
        np.testing.assert_array_equal(first.device_from_tip, goals.pose)
        felt.placed(in_the_patient())
        goals.buttons = 2
        flown = read_many(source, 60)
        assert height_of(flown[-1]) == pytest.approx(3.0 + RADIUS_MM, abs=0.4)
        assert flown[-1].buttons == 2
        # both clocks are the hand's
        assert flown[-1].time_s == goals.number / 100
        goals.pose = place(-3.0)
        flown = read_many(source, 100)
        held = height_of(flown[-1])
        assert -2.5 < held < RADIUS_MM
        assert height_of(replace(flown[-1], device_from_tip=goals.pose)) < held - 0.3
    assert set(threading.enumerate()) <= before
    assert "Force loop" in felt.last_lines()[0]


def test_a_device_that_goes_away_is_a_device_that_went_away(
    bare_room: PatientScene,
) -> None:
    felt, _ = goal_input("unplugged@0.3+0.4")
    with felt.open(bare_room) as source:
        felt.placed(in_the_patient())
        with pytest.raises(DeviceError, match="went away") as caught:
            read_many(source, 300)
        assert caught.value.reason is DeviceReason.DISCONNECTED
        # told once; then it is back
        assert read_many(source, 5)


def test_a_silent_device_gives_no_poses(bare_room: PatientScene) -> None:
    felt, _ = goal_input("silent@0.2")
    with felt.open(bare_room) as source:
        felt.placed(in_the_patient())
        with pytest.raises(TimeoutError, match="from the emulated force device"):
            read_many(source, 400)


def test_a_recordings_own_pose_is_replaced_by_the_devices() -> None:
    sample = Sample(1.0, place(0.0), 12.0, np.zeros(3), np.array([0.0, 1.0, 0.0]), 0)
    felt, _ = goal_input()
    felt.completer.inner = RecordedSamples({1.0: sample})  # type: ignore[attr-defined]
    flown = felt.completer.complete(Pose(1.0, 1.0, place(2.0), 0))
    np.testing.assert_array_equal(flown.device_from_tip, place(2.0))
    assert flown.roll_deg == 12.0


def test_the_words_of_the_command_choose(exercise: Exercise) -> None:
    scenario, path = exercise
    mouse = MouseInput(scenario, path)
    assert felt_input("none", None, mouse, scenario) is mouse
    held = [mouse.is_held_by_walls]
    felt = felt_input("emulated", "lying@3", mouse, scenario)
    assert [*held, mouse.is_held_by_walls] == [True, False]
    assert felt.controls is mouse.controls
    assert felt.keys == mouse.keys
    assert "emulated" in felt.name
    with pytest.raises(UserError, match=r"none, emulated or force-dimension"):
        felt_input("phantom", None, mouse, scenario)
    with pytest.raises(UserError, match="add --haptics emulated"):
        felt_input("none", "lying", mouse, scenario)
    with pytest.raises(UserError, match="--haptics-fault must be"):
        felt_input("emulated", "deaf", mouse, scenario)
