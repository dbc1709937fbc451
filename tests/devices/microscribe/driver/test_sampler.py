from collections.abc import Callable
from typing import Any

import pytest

from devices.microscribe.driver.sampler import ArmSampler, HomeState
from devices.microscribe.emulator.firmware import ArmFirmware
from devices.microscribe.kinematics.profiles import DX40937, SECOND_3DX
from devices.microscribe.wire.line import LinkTiming
from devices.microscribe.wire.link import ArmLink
from devices.port import DeviceError, DeviceReason
from devices.pose import Pose

ONE_RATE = (115200,)


def _silent(out: bytes) -> bytes:
    return b""


def _poses(sampler: ArmSampler, tries: int) -> list[Pose]:
    return [pose for _ in range(tries) for pose in sampler.next_poses()]


def _reason(sampler: ArmSampler) -> DeviceReason:
    with pytest.raises(DeviceError) as caught:
        _poses(sampler, 6)
    return caught.value.reason


def test_a_short_interruption_is_bridged_by_a_ping(
    serve_arm: Callable[..., Any], hasty: LinkTiming
) -> None:
    arm = serve_arm()
    sampler = ArmSampler(ArmLink(arm.port, hasty), ONE_RATE)
    assert len(_poses(sampler, 3)) == 3
    swallowed: list[bytes] = []

    def swallow_two(out: bytes) -> bytes:
        if out and len(swallowed) < 2:
            swallowed.append(out)
            return b""
        return out

    arm.spoil = swallow_two
    assert len(_poses(sampler, 5)) == 3
    assert (sampler.missed, sampler.recoveries) == (2, 1)
    assert sampler.home_state is HomeState.ASSUMED


def test_silence_for_good_is_a_disconnection(
    serve_arm: Callable[..., Any], hasty: LinkTiming
) -> None:
    arm = serve_arm()
    sampler = ArmSampler(ArmLink(arm.port, hasty), ONE_RATE)
    _poses(sampler, 1)
    arm.spoil = _silent
    assert _reason(sampler) is DeviceReason.DISCONNECTED


def test_an_ended_session_is_opened_anew(
    serve_arm: Callable[..., Any], hasty: LinkTiming
) -> None:
    arm = serve_arm()
    sampler = ArmSampler(ArmLink(arm.port, hasty), ONE_RATE)
    _poses(sampler, 1)
    # Somebody pulled the arm's session away: it listens for attention again.
    arm.firmware.receive(b"\xc5", 0.0)
    assert len(_poses(sampler, 4)) == 2
    assert sampler.home_state is HomeState.ASSUMED


def test_a_power_cut_makes_the_arm_untrusted(
    serve_arm: Callable[..., Any], hasty: LinkTiming
) -> None:
    arm = serve_arm()
    link = ArmLink(arm.port, hasty)
    sampler = ArmSampler(link, ONE_RATE)
    _poses(sampler, 1)
    arm.firmware = ArmFirmware(DX40937, arm.motion, -9.0)
    assert _poses(sampler, 4) == []
    states = [sampler.home_state]
    sampler.home()
    states.append(sampler.home_state)
    assert states == [HomeState.UNKNOWN, HomeState.HOMED]
    assert arm.motion.homed == 1
    assert len(_poses(sampler, 2)) == 2


def test_another_arm_on_the_same_line_is_refused(
    serve_arm: Callable[..., Any], hasty: LinkTiming
) -> None:
    arm = serve_arm()
    sampler = ArmSampler(ArmLink(arm.port, hasty), ONE_RATE)
    _poses(sampler, 1)
    arm.firmware = ArmFirmware(SECOND_3DX, arm.motion, 0.0)
    assert _reason(sampler) is DeviceReason.WRONG_DEVICE


def test_an_arm_that_answers_questions_only_waits_for_its_home_button(
    serve_arm: Callable[..., Any], hasty: LinkTiming
) -> None:
    arm = serve_arm()
    arm.spoil = lambda out: b"" if out[:1] in (b"\xa3", b"\x80") else out
    sampler = ArmSampler(ArmLink(arm.port, hasty), ONE_RATE)
    assert _reason(sampler) is DeviceReason.NOT_HOMED


def test_without_assurance_there_are_no_poses(
    serve_arm: Callable[..., Any], hasty: LinkTiming
) -> None:
    arm = serve_arm()
    sampler = ArmSampler(ArmLink(arm.port, hasty), ONE_RATE, assume_home=False)
    assert _poses(sampler, 2) == []
    sampler.home()
    assert len(_poses(sampler, 2)) == 2
