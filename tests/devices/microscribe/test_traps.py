"""Known ways in which hosts of this arm go wrong, each with a test named after it.

Numbers as in the list of traps that the driver was written against; missing ones
concern the emulator or people, not the host.
"""

import os
import sys
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from devices.microscribe.driver.driver import SerialPort
from devices.microscribe.driver.sampler import MotionReports
from devices.microscribe.driver.supervisor import ArmSettings
from devices.microscribe.driver.tracker import SampleTracker
from devices.microscribe.emulator.firmware import FirmwareState
from devices.microscribe.kinematics.arm import ArmGeometry, Encoders
from devices.microscribe.kinematics.forward import ForwardKinematics
from devices.microscribe.kinematics.profiles import (
    DX40937,
    HOME_COUNTS,
    ODD_MAXIMA,
    SIX_JOINTS,
)
from devices.microscribe.wire import commands
from devices.microscribe.wire.commands import ALLOWED, Query
from devices.microscribe.wire.link import ArmLink
from devices.microscribe.wire.packets import Packet, PacketLayout
from devices.microscribe.wire.protocol import Reply
from devices.microscribe.wire.sign_on import RATES
from devices.port import DeviceError, DeviceReason
from tests.devices.microscribe.conftest import idle_session

Bench = Any
Rehearse = Callable[..., Bench]
STREAM = MotionReports(period_ticks=9)


def test_t1_begin_follows_an_echo_at_once_and_is_never_repeated(
    rehearse: Rehearse,
) -> None:
    bench = rehearse("f5")
    with pytest.raises(DeviceError):
        bench.connect()
    sent = bench.written
    begins = [i for i, data in enumerate(sent) if data == b"BEGIN"]
    assert len(begins) == 2
    # A new search, which begins with the end of any session, lies between them.
    assert all(sent[i - 1] == b"\xc5IMMC" for i in begins)
    assert bench.motion.homed == 0


def test_t2_attention_is_never_asked_for_without_an_end_in_front(
    rehearse: Rehearse,
) -> None:
    bench = rehearse("f7=RUN")
    bench.connect()
    assert not [data for data in bench.written if data.startswith(b"I")]
    assert bench.line.arm.firmware.memory_writes == 0


@pytest.mark.parametrize("left", ["f7=ARGS", "f7=PASSWORD"])
def test_t3_a_half_said_command_is_completed_before_the_first_letter(
    rehearse: Rehearse, left: str
) -> None:
    bench = rehearse(left)
    supervisor = bench.connect()
    assert supervisor.sampler.description.identity == DX40937.identity
    assert bench.written[:2] == [commands.CLEAR_BYTES, b"\xc5IMMC"]
    # No more than the longest command takes, and the END that ends the session.
    assert len(commands.CLEAR_BYTES) == 36 + 1


def test_t5_the_end_is_one_byte_and_not_the_word(rehearse: Rehearse) -> None:
    bench = rehearse()
    bench.connect().close()
    assert bench.written[-1] == b"\xc5"
    assert bench.line.arm.firmware.state is FirmwareState.SYNC
    assert b"D" not in set(ALLOWED)


@pytest.mark.skipif(sys.platform == "win32", reason="pseudo-terminals need POSIX")
def test_t6_every_byte_passes_through_the_terminal() -> None:
    """Ctrl-C, XON, XOFF, carriage return and all the rest are data."""
    master, client = os.openpty()
    port = SerialPort(os.ttyname(client))
    everything = bytes(range(256))
    try:
        port.write(everything)
        assert os.read(master, 512) == everything
        os.write(master, everything)
        assert port.read(256, 1.0) == everything
    finally:
        port.close()
        os.close(master)
        os.close(client)


def test_t7_configuration_replies_are_read_by_length_after_the_stream_has_stopped(
    rehearse: Rehearse,
) -> None:
    bench = rehearse(reports=STREAM)
    supervisor = bench.connect()
    bench.run(supervisor, 0.5)
    supervisor.home()
    stop, home = bench.written.index(b"\x00"), bench.written.index(b"\xc2")
    assert stop < home
    session = idle_session()
    session.ask(Query.MAXIMA)
    maxima = bytes.fromhex("03 3F FF" + "A3" * 21)
    assert session.receive(b"\xc6" + maxima) == [Reply(Query.MAXIMA, maxima)]


def test_t8_encoder_codes_are_not_in_numeric_order() -> None:
    assert [PacketLayout(code).encoders for code in range(4)] == [0, 5, 7, 6]
    assert commands.POSE_LAYOUT.encoders == 6


def test_t8_another_product_is_refused_before_its_table_is_needed(
    rehearse: Rehearse,
) -> None:
    bench = rehearse("f6=IBOX")
    bench.refused(DeviceReason.WRONG_DEVICE, (115200,))
    assert b"\xd3" not in bench.written


def test_t9_the_timers_maximum_is_not_the_first_encoders(rehearse: Rehearse) -> None:
    supervisor = rehearse(profile=ODD_MAXIMA).connect()
    assert supervisor.sampler.tracker.timer_turn == 0x3A98
    assert supervisor.sampler.description.encoders.turn[0] == 0x3E80


def test_t11_an_encoder_that_is_not_there_turns_nothing() -> None:
    forward = ForwardKinematics(DX40937.geometry, DX40937.encoders)
    tips = [
        forward.device_from_tip(np.array((*HOME_COUNTS[:5], n)))
        for n in (0, 8416, 16383)
    ]
    assert (tips[0] == tips[1]).all()
    assert (tips[0] == tips[2]).all()


@pytest.mark.parametrize("rate", RATES)
def test_t15_a_session_left_open_is_ended_at_its_own_rate(
    rehearse: Rehearse, rate: int
) -> None:
    bench = rehearse()
    first = bench.connect(ArmSettings(rates=(rate,)))
    bench.run(first, 0.1)
    # That host dies now, without a word.
    supervisor = bench.connect(ArmSettings(rates=RATES))
    assert supervisor.link.baud in RATES
    bench.steady(bench.run(supervisor, 0.3))


def test_t15b_the_five_bytes_are_one_write(rehearse: Rehearse) -> None:
    bench = rehearse("f1")
    bench.refused(DeviceReason.NO_DEVICE, RATES)
    assert set(bench.written) == {commands.CLEAR_BYTES, b"\xc5IMMC", b"\xc5"}
    # Once at each rate of each pass.
    assert bench.written.count(commands.CLEAR_BYTES) == 2 * len(RATES)


def test_t16_streams_have_a_fixed_rate(rehearse: Rehearse) -> None:
    bench = rehearse(reports=STREAM)
    poses = bench.run(bench.connect(), 2.0)
    asked = [data for data in bench.written if data[0] == commands.MOTION]
    assert asked == [b"\xcf\x00\x09\x23" + bytes(21)]
    # The arm stands still and is heard nevertheless.
    assert len(poses) == pytest.approx(200, abs=5)


def test_t19_bursts_of_an_adapter_are_not_in_the_times(rehearse: Rehearse) -> None:
    bench = rehearse("f14=16", reports=MotionReports(period_ticks=2))
    poses = bench.run(bench.connect(), 6.0)
    late = [pose.host_time_s - pose.time_s for pose in poses[len(poses) // 2 :]]
    assert max(late) - min(late) < 0.002


def test_t20_six_encoders_are_asked_for_and_seven_never_read(
    rehearse: Rehearse,
) -> None:
    bench = rehearse()
    supervisor = bench.connect()
    bench.run(supervisor, 0.1)
    polls = {data for data in bench.written if len(data) == 1 and data[0] < 0x40}
    assert polls == {b"\x23"}
    assert len(supervisor.sampler.description.maxima.encoders) == 6


def test_t21_an_adapter_that_resets_on_opening_is_waited_for(
    rehearse: Rehearse,
) -> None:
    """An Arduino in between sleeps for more than a second after the port opens."""
    bench = rehearse()
    bench.line.arm.unplug(0.0)
    bench.line.arm.replug(0.0)
    port = bench.open(bench.line.name)
    began = bench.line.clock.now()
    hear = bench.line.arm.hear
    awake_s = began + 1.3

    def drowsy(data: bytes, now_s: float, rate: int | None = None) -> None:
        if now_s >= awake_s:
            hear(data, now_s, rate)

    bench.line.arm.hear = drowsy
    link = ArmLink(port, clock=bench.line.clock)
    link.sign_on((115200,))
    assert bench.line.clock.now() > awake_s


def test_t22_a_stylus_in_line_with_the_forearm_is_still_a_pose() -> None:
    """Joint 3 is ill-defined there; forward kinematics are not."""
    geometry = ArmGeometry.from_words(DX40937.dh_words, DX40937.beta_word)
    forward = ForwardKinematics(geometry, Encoders(DX40937.encoders.turn))
    for count in (0, 2048):
        frame = forward.device_from_tip(np.array((*HOME_COUNTS[:4], count, 0)))
        assert np.abs(frame[:3, :3] @ frame[:3, :3].T - np.eye(3)).max() < 1e-12


def test_the_index_pulse_of_a_six_joint_arm_is_no_pedal() -> None:
    packet = Packet(0x23, 0b111, 5, HOME_COUNTS)
    for profile, buttons in ((DX40937, 0b111), (SIX_JOINTS, 0b011)):
        pose = SampleTracker(profile.geometry, profile.encoders).accept(packet, 0.0)
        assert pose is not None
        assert pose.buttons == buttons
