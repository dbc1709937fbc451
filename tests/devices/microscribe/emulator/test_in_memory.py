import threading
import time

import pytest

from devices.microscribe.emulator.emulated_arm import EmulatedArm
from devices.microscribe.emulator.in_memory import (
    MemoryLine,
    MemorySerial,
)
from devices.microscribe.emulator.motion import StillMotion
from devices.microscribe.kinematics.profiles import DX40937
from devices.port import BytePort, DeviceError, DeviceReason, HostClock
from tests.devices.microscribe.rare_faults import parse_any_fault

BYTE_S = 10.0 / 115200
POLL, PACKET = b"\x23", 16


def memory_line(*faults: str) -> MemoryLine:
    plans = [parse_any_fault(text) for text in faults]
    return MemoryLine(EmulatedArm(DX40937, StillMotion(DX40937), faults=plans))


def signed_on(line: MemoryLine, timeout: float | None = 0.1) -> MemorySerial:
    port = line.open_serial(timeout=timeout)
    port.write(b"\xc5IMMC")
    assert port.read(4) == b"IMMC"
    port.write(b"BEGIN")
    assert port.read(5) == b"MSCR\0"
    return port


def now(line: MemoryLine) -> float:
    return line.clock.now()


def test_reading_moves_the_clock_by_what_the_line_takes() -> None:
    line = memory_line()
    port = signed_on(line)
    begun = now(line)
    port.write(POLL)
    assert port.read(1) == b"\xa3"
    # The command's byte, the arm's thought, the header.
    assert now(line) - begun == pytest.approx(BYTE_S + 0.001 + BYTE_S)
    assert port.in_waiting == 0
    assert len(port.read(PACKET)) == PACKET - 1
    assert now(line) - begun == pytest.approx(0.1 + 2 * BYTE_S + 0.001)


def test_four_hundred_polls_a_second_are_the_most() -> None:
    line = memory_line()
    port = signed_on(line)
    begun = now(line)
    for _ in range(1000):
        port.write(POLL)
        assert len(port.read(PACKET)) == PACKET
    assert 1000 / (now(line) - begun) == pytest.approx(404.0, abs=1.0)


def test_a_read_without_timeout_that_cannot_end_says_so() -> None:
    port = memory_line().open_serial()
    with pytest.raises(TimeoutError, match="never end"):
        port.read(1)


def test_a_zero_timeout_never_moves_the_clock() -> None:
    line = memory_line()
    port = signed_on(line)
    port.timeout = 0.0
    begun = now(line)
    port.write(POLL)
    assert port.read(99) == b""
    assert now(line) == begun
    with pytest.raises(ValueError, match="does not go back"):
        line.clock.sleep(-1.0)


def test_what_is_unread_can_be_dropped() -> None:
    line = memory_line()
    port = signed_on(line)
    port.write(POLL)
    line.clock.sleep(0.1)
    assert port.in_waiting == PACKET
    port.reset_input_buffer()
    assert port.in_waiting == 0


def test_a_pulled_plug_is_an_error_and_comes_back_elsewhere() -> None:
    line = memory_line()
    port = signed_on(line)
    line.arm.unplug(now(line))
    for use in (port.read, lambda: port.write(b"x"), lambda: port.in_waiting):
        with pytest.raises(OSError, match="gone"):
            use()
    with pytest.raises(OSError, match="gone"):
        line.open_serial()
    line.arm.replug(now(line))
    with pytest.raises(OSError, match="gone"):
        port.read()
    again = line.open_serial(timeout=0.1)
    assert again.port != port.port
    # The data plug only: the arm kept its power and its session.
    again.write(POLL)
    assert len(again.read(PACKET)) == PACKET


def test_a_closed_port_leaves_the_session_open() -> None:
    line = memory_line()
    with signed_on(line) as port:
        pass
    with pytest.raises(OSError, match="closed"):
        port.read(1)
    other = line.open_serial(timeout=0.1)
    other.write(POLL)
    assert len(other.read(PACKET)) == PACKET


def test_the_byte_port_speaks_our_drivers_errors() -> None:
    line = memory_line()
    signed_on(line)
    port: BytePort = line.open_port()
    port.write(POLL)
    assert port.read(4, 0.1)[:1] == b"\xa3"
    line.clock.sleep(0.1)
    assert port.waiting == PACKET - 4
    assert port.reset_input() == PACKET - 4
    port.set_rate(9600)
    port.set_rate(115200)
    port.write(POLL)
    assert len(port.read(64, 0.1, 0.01)) == PACKET
    line.arm.unplug(now(line))
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
    line = MemoryLine(arm, HostClock())
    port = signed_on(line, timeout=5.0)
    heard: list[bytes] = []
    reader = threading.Thread(target=lambda: heard.append(port.read(PACKET)))
    reader.start()
    port.write(POLL)
    reader.join()
    assert heard[0][:1] == b"\xa3"
    assert len(heard[0]) == PACKET
