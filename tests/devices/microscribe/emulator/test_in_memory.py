import threading
import time
from collections.abc import Callable
from typing import Any

import pytest

from devices.microscribe.emulator.emulated_arm import EmulatedArm
from devices.microscribe.emulator.in_memory import MemoryLine
from devices.microscribe.emulator.motion import StillMotion
from devices.microscribe.kinematics.profiles import DX40937
from devices.port import BytePort, DeviceError, DeviceReason, HostClock

BYTE_S = 10.0 / 115200
POLL, PACKET = b"\x23", 16


Connect = Callable[..., Any]


def test_reading_moves_the_clock_by_what_the_line_takes(connect: Connect) -> None:
    client = connect()
    client.sign_on()
    client.port.timeout = 0.1
    begun_s = client.now_s
    client.port.write(POLL)
    assert client.port.read(1) == b"\xa3"
    # The command's byte, the arm's thought, the header.
    assert client.now_s - begun_s == pytest.approx(BYTE_S + 0.001 + BYTE_S)
    assert client.port.in_waiting == 0
    assert len(client.port.read(PACKET)) == PACKET - 1
    assert client.now_s - begun_s == pytest.approx(0.1 + 2 * BYTE_S + 0.001)


def test_four_hundred_polls_a_second_are_the_most(connect: Connect) -> None:
    client = connect()
    client.sign_on()
    begun_s = client.now_s
    for _ in range(1000):
        client.port.write(POLL)
        assert len(client.port.read(PACKET)) == PACKET
    assert 1000 / (client.now_s - begun_s) == pytest.approx(404.0, abs=1.0)


def test_a_read_without_timeout_that_cannot_end_says_so(connect: Connect) -> None:
    port = connect().port
    port.timeout = None
    with pytest.raises(TimeoutError, match="never end"):
        port.read(1)


def test_a_zero_timeout_never_moves_the_clock(connect: Connect) -> None:
    client = connect()
    client.sign_on()
    begun_s = client.now_s
    assert client.ask(POLL, 0.0) == b""
    assert client.now_s == begun_s
    with pytest.raises(ValueError, match="-1"):
        client.line.clock.sleep(-1.0)


def test_what_is_unread_can_be_dropped(connect: Connect) -> None:
    client = connect()
    client.sign_on()
    client.port.write(POLL)
    client.passes(0.1)
    assert client.port.in_waiting == PACKET
    client.port.reset_input_buffer()
    assert client.port.in_waiting == 0


def test_a_pulled_plug_is_an_error_and_comes_back_elsewhere(connect: Connect) -> None:
    client = connect()
    client.sign_on()
    line, port = client.line, client.port
    client.arm.unplug(client.now_s)
    for use in (port.read, lambda: port.write(b"x"), lambda: port.in_waiting):
        with pytest.raises(OSError, match="gone"):
            use()
    with pytest.raises(OSError, match="gone"):
        line.open_serial()
    client.arm.replug(client.now_s)
    with pytest.raises(OSError, match="gone"):
        port.read()
    client.port = line.open_serial()
    assert client.port.port != port.port
    # The data plug only: the arm kept its power and its session.
    assert len(client.ask(POLL)) == PACKET


def test_a_closed_port_leaves_the_session_open(connect: Connect) -> None:
    client = connect()
    client.sign_on()
    with client.port as port:
        pass
    with pytest.raises(OSError, match="closed"):
        port.read(1)
    client.port = client.line.open_serial()
    assert len(client.ask(POLL)) == PACKET


def test_the_byte_port_speaks_our_drivers_errors(connect: Connect) -> None:
    client = connect()
    client.sign_on()
    line = client.line
    port: BytePort = line.open_port()
    port.write(POLL)
    assert port.read(4, 0.1)[:1] == b"\xa3"
    client.passes(0.1)
    assert port.waiting == PACKET - 4
    assert port.reset_input() == PACKET - 4
    port.set_rate(9600)
    port.set_rate(115200)
    port.write(POLL)
    assert len(port.read(64, 0.1, 0.01)) == PACKET
    client.arm.unplug(client.now_s)
    for use in (
        lambda: port.read(1, 0.1),
        lambda: port.write(b"x"),
        lambda: port.waiting,
        port.reset_input,
    ):
        with pytest.raises(DeviceError) as caught:
            use()
        assert caught.value.reason is DeviceReason.DISCONNECTED
    with pytest.raises(DeviceError) as caught:
        line.open_port()
    assert caught.value.reason is DeviceReason.NO_PORT
    port.close()


def test_the_same_line_runs_in_real_time_for_two_threads() -> None:
    arm = EmulatedArm(DX40937, StillMotion(DX40937), now_s=time.monotonic())
    port = MemoryLine(arm, HostClock()).open_serial(timeout=5.0)
    port.write(b"\xc5IMMC")
    assert port.read(4) == b"IMMC"
    port.write(b"BEGIN")
    assert port.read(5) == b"MSCR\0"
    heard: list[bytes] = []
    reader = threading.Thread(target=lambda: heard.append(port.read(PACKET)))
    reader.start()
    port.write(POLL)
    reader.join()
    assert heard[0][:1] == b"\xa3"
    assert len(heard[0]) == PACKET
