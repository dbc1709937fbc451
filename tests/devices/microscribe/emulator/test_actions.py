import pytest

from devices.microscribe.emulator.actions import (
    ACTIONS,
    ActionSchedule,
    list_actions,
    parse_action,
)
from devices.microscribe.emulator.emulated_arm import EmulatedArm
from devices.microscribe.emulator.motion import StillMotion
from devices.microscribe.kinematics.profiles import DX40937, G2_UNHOMED


def running() -> EmulatedArm:
    """Give an arm whose first packet was asked for at 10 s."""
    arm = EmulatedArm(DX40937, StillMotion(DX40937), now_s=9.0)
    arm.hear(b"IMMCBEGIN\x03", 10.0)
    return arm


def test_things_are_done_in_order_at_their_moments() -> None:
    arm = running()
    texts = ("unplug@3+2", "right_pedal@1+1", "left_pedal@1.5", "release_left@4")
    schedule = ActionSchedule(tuple(parse_action(text) for text in texts))
    story = []
    for tenths in range(0, 60, 5):
        now = 10.0 + tenths / 10.0
        schedule.perform(arm, now)
        story.append((arm.plugged, arm.latch(now)[1]))
    assert [pedals for _, pedals in story] == [0, 0, 1, 3, 2, 2, 2, 2, 0, 0, 0, 0]
    assert [plugged for plugged, _ in story] == [True] * 6 + [False] * 4 + [True] * 2
    assert schedule.wait_s(arm, 20.0) == float("inf")


def test_the_wait_is_until_the_next_thing() -> None:
    arm = running()
    schedule = ActionSchedule((parse_action("power_cycle@3"),))
    assert schedule.wait_s(arm, 11.0) == pytest.approx(2.0)
    assert schedule.wait_s(arm, 15.0) == 0.0


def test_zero_is_power_on() -> None:
    arm = EmulatedArm(G2_UNHOMED, StillMotion(G2_UNHOMED))
    ActionSchedule((parse_action("home_button"),)).perform(arm, 0.0)
    assert arm.firmware.homed


def test_power_goes_and_comes() -> None:
    arm = running()
    schedule = ActionSchedule((parse_action("power_off@1+1"),))
    states = []
    for now in (10.5, 11.0, 11.5, 12.0):
        schedule.perform(arm, now)
        states.append(arm.powered)
    assert states == [True, False, False, True]


@pytest.mark.parametrize("name", ACTIONS)
def test_every_action_is_listed_and_can_be_done(name: str) -> None:
    parse_action(name).start(running(), 11.0)
    assert list_actions()[name]


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("unplugg@3", "nearest is 'unplug'"),
        ("", "must be one of"),
        ("unplug@x", "moment"),
        ("unplug@p:0.1", "in seconds"),
        ("power_cycle@1+1", "no duration"),
    ],
)
def test_mistakes_are_told(text: str, complaint: str) -> None:
    with pytest.raises(ValueError, match=complaint):
        parse_action(text)
