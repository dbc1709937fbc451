import os
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

if sys.platform == "win32":
    pytest.skip("pseudo-terminals need POSIX", allow_module_level=True)

import serial

from devices.microscribe.emulator.actions import ActionSchedule, parse_action
from devices.microscribe.emulator.emulated_arm import EmulatedArm
from devices.microscribe.emulator.motion import AnglesMotion, StillMotion
from devices.microscribe.emulator.server import EmulatorServer
from devices.microscribe.emulator.socket_port import SocketPort
from devices.microscribe.emulator.terminal_port import TerminalPort
from devices.microscribe.kinematics.profiles import DX40937
from tests.devices.microscribe.rare_faults import parse_any_fault


def make_arm(*faults: str) -> EmulatedArm:
    plans = [parse_any_fault(text) for text in faults]
    still = StillMotion(DX40937)
    return EmulatedArm(DX40937, still, faults=plans, now_s=time.monotonic())


def sign_on(client: serial.SerialBase) -> None:
    client.write(b"\xc5IMMC")
    assert client.read(4) == b"IMMC"
    client.write(b"BEGIN")
    assert client.read(5) == b"MSCR\0"


def open_client(server: EmulatorServer) -> serial.SerialBase:
    client = serial.serial_for_url(server.port_name, 115200)
    client.timeout = 5.0
    return client


def poll_until_gone(client: serial.SerialBase) -> None:
    """Poll until the port fails, which it must before the test times out."""
    try:
        client.timeout = 0.02  # this, too, may be where it is found gone
        while True:
            client.write(b"\x03")
            client.read(14)
    except OSError:
        return


@pytest.mark.parametrize("kind", ["terminal", "socket"])
def test_other_peoples_software_reaches_it(kind: str) -> None:
    port = TerminalPort() if kind == "terminal" else SocketPort(("127.0.0.1", 0))
    with EmulatorServer(make_arm(), port) as server, open_client(server) as client:
        sign_on(client)
        for _ in range(20):
            client.write(b"\x23")
            assert client.read(16)[:1] == b"\xa3"
        client.write(b"\xcf\x00\x05\x03" + bytes(21))
        assert client.read(1 + 14 * 20)[1::14] == b"\x83" * 20
    assert server.failure is None


def test_a_port_that_comes_back_elsewhere_is_announced() -> None:
    names: list[str] = []
    back = threading.Event()

    def announce(name: str) -> None:
        names.append(name)
        if len(names) == 2:
            back.set()

    actions = ActionSchedule((parse_action("unplug@0.1+0.1"),))
    arm = make_arm()
    with EmulatorServer(
        arm, TerminalPort(), actions=actions, announce=announce
    ) as server:
        client = open_client(server)
        sign_on(client)
        client.write(b"\x03")
        poll_until_gone(client)
        client.close()
        assert back.wait(5.0)
        with open_client(server) as again:
            again.write(b"\x03")
            assert again.read(14)[:1] == b"\x83"
    assert names[0] != names[1]


def test_a_plug_out_and_in_again_between_two_looks_moves_the_port() -> None:
    """Both lines are read at once, as on a machine that had stalled."""
    read, write = os.pipe()
    os.write(write, b"unplug\nreplug\n")
    os.close(write)  # which ends the service
    names: list[str] = []
    server = EmulatorServer(make_arm(), TerminalPort(), announce=names.append)
    try:
        server.run(read)
        assert len(names) == 2
        assert names[0] != names[1] == server.port_name
    finally:
        server.close()
        os.close(read)


def test_a_fault_that_unplugs_for_good_ends_the_service() -> None:
    with EmulatorServer(make_arm("unplug@0"), TerminalPort()) as server:
        client = open_client(server)
        client.write(b"\xc5IMMC")
        poll_until_gone(client)
        client.close()
    assert server.arm.lost_for_good


def test_a_function_that_fails_takes_the_port_away_and_is_told() -> None:
    def breaks(t_s: float) -> list[float]:
        return [0.0] * 5 if t_s < 0.05 else [np.nan] * 5

    arm = EmulatedArm(DX40937, AnglesMotion(DX40937, breaks), now_s=time.monotonic())
    with EmulatorServer(arm, TerminalPort()) as server:
        client = open_client(server)
        sign_on(client)
        poll_until_gone(client)
        client.close()
    assert isinstance(server.failure, ValueError)


def test_lines_of_commands_are_obeyed_and_their_end_ends_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    commands = tmp_path / "commands"
    commands.write_text("left_pedal\nnonsense\n\n")
    server = EmulatorServer(make_arm(), TerminalPort())
    with commands.open("rb") as file:
        server.run(file.fileno())
    server.close()
    assert server.arm.latch(0.0)[1] == 2
    assert "action must be one of" in capsys.readouterr().err
