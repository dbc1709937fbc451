import pytest

from devices.microscribe.emulator.emulated_arm import EmulatedArm
from devices.microscribe.emulator.in_memory import MemoryLine
from devices.microscribe.emulator.motion import StillMotion
from devices.microscribe.kinematics.profiles import DX40937, HOME_COUNTS
from devices.microscribe.wire.link import ArmLink
from devices.microscribe.wire.protocol import State
from devices.port import DeviceError, DeviceReason
from tests.devices.microscribe.spoilt_arm import spoilt_link


@pytest.mark.parametrize(
    ("code", "words"),
    [(0xC8, "product name"), (0xCA, "model"), (0xCB, "serial"), (0xCE, "firmware")],
)
def test_an_arm_that_leaves_out_who_it_is_is_told_what_it_left_out(
    code: int, words: str
) -> None:
    link = spoilt_link(lambda out: bytes((code, 0)) if out[0] == code else out)
    with pytest.raises(DeviceError, match=words) as caught:
        link.describe()
    assert caught.value.reason is DeviceReason.BAD_REPLY


def test_sign_on_describe_sample_end() -> None:
    motion = StillMotion(DX40937)
    line = MemoryLine(EmulatedArm(DX40937, motion))
    link = ArmLink(line.open_port(), clock=line.clock)
    link.sign_on((115200,))
    described = link.describe()
    assert described.identity == DX40937.identity
    assert described.maxima == DX40937.maxima
    assert described.geometry.d_mm.tolist() == DX40937.geometry.d_mm.tolist()
    assert described.geometry.beta == DX40937.geometry.beta
    motion.buttons = 2
    sample = link.sample()
    assert sample is not None
    assert sample[0].counts == HOME_COUNTS
    assert sample[0].buttons == 2
    assert link.ping()
    link.end()
    assert link.session.state is State.OFF
    assert line.arm.firmware.state.name == "SYNC"
    assert motion.homed == 0
    assert link.session.stray == 0


def test_a_sign_on_left_half_way_by_a_dead_host_is_taken_over() -> None:
    line = MemoryLine(EmulatedArm(DX40937, StillMotion(DX40937)))
    line.open_serial().write(b"IMMC")
    link = ArmLink(line.open_port(), clock=line.clock)
    link.sign_on((115200,))
    assert link.serial_number() == DX40937.identity.serial
