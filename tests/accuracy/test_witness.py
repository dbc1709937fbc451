"""A driver that others wrote meets the emulated arm.

microcmm 0.1.0 was tested by its author on a real arm. It is no dependency of ours: it
wants Python 3.12 and is needed for this one test. CONTRIBUTING.md says how to run it.
"""

import importlib
import importlib.util
import itertools
import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import pytest
import serial

from devices.microscribe.emulator.emulated_arm import ArmTraits, EmulatedArm
from devices.microscribe.emulator.motion import StillMotion
from devices.microscribe.emulator.server import EmulatorServer
from devices.microscribe.emulator.socket_port import SocketPort
from devices.microscribe.kinematics.profiles import DX40937

if sys.platform == "win32":
    pytest.skip("pseudo-terminals need POSIX", allow_module_level=True)

from devices.microscribe.emulator.terminal_port import TerminalPort

FOLDER = "PARAVOL_WITNESS"
"""Environment variable with the folder into which microcmm was installed."""

# What the recorded counts of the rest pose give with the constants of that arm.
TIP_MM = (54.196618, -51.842714, 212.200470)
MAXIMA = [16383, 16383, 8191, 4095, 4095, 0]


@pytest.fixture(scope="module")
def witness() -> Any:
    """Import the other driver, or say how to get it."""
    folder = os.environ.get(FOLDER)
    if folder is not None:
        sys.path.append(folder)
    if importlib.util.find_spec("microcmm") is None:
        pytest.skip(
            f"microcmm is not installed; see CONTRIBUTING.md, and point {FOLDER} at it"
        )
    return importlib.import_module("microcmm")


@contextmanager
def served(fast: bool, kind: str) -> Iterator[Callable[[], Any]]:
    """Serve an arm at rest; give a function that opens its port."""
    still = StillMotion(DX40937)
    arm = EmulatedArm(
        DX40937, still, now_s=time.monotonic(), traits=ArmTraits(fast=fast)
    )
    port = TerminalPort() if kind == "terminal" else SocketPort(("127.0.0.1", 0))
    with EmulatorServer(arm, port) as server:

        def opened() -> Any:
            name = server.port_name
            return name if kind == "terminal" else serial.serial_for_url(name)

        yield opened
    assert server.failure is None
    assert arm.firmware.memory_writes == 0
    assert still.homed == 1, "the witness homed the arm once, by its own wish"


@pytest.mark.parametrize("kind", ["terminal", "socket"])
@pytest.mark.parametrize("fast", [True, False], ids=["fast", "paced"])
def test_it_signs_on_asks_polls_streams_leaves_and_comes_back(
    witness: Any, fast: bool, kind: str
) -> None:
    with served(fast, kind) as opened:
        with witness.MicroScribe(opened(), allow_untested_models=True) as arm:
            about = arm.info
            assert (about.product_name, about.product_id) == ("MicroScribe3D", "MSCR")
            assert (about.model_name, about.serial_number) == ("DX", "EMU00001")
            assert (about.comment, about.version) == ("Standard+Beta", "HCI 2.0")
            assert arm.maxes.max_encoder == MAXIMA
            assert (arm.maxes.buttons_supported, arm.maxes.max_timer) == (3, 16383)
            arm.home()
            pose = arm.pose()
            assert (pose.x, pose.y, pose.z) == pytest.approx(TIP_MM, abs=1e-6)
            timers = [arm.hci.sample(6, True).timer for _ in range(1000)]
            passed = [(b - a) % 16384 for a, b in itertools.pairwise(timers)]
            assert max(passed) < 8192
            for encoders in (5, 6, 7):
                packet = arm.hci.sample(encoders)
                assert len(packet.encoders) == encoders
            command = arm.hci.start_motion(6, True, delay_ms=9)
            stream = [arm.hci.read_packet(command).timer for _ in range(50)]
            assert [(b - a) % 16384 for a, b in itertools.pairwise(stream)] == [9] * 49
            arm.hci.end_motion()
            assert arm.hci.get_string(0xCB) == "EMU00001"
        with witness.MicroScribe(opened(), allow_untested_models=True) as again:
            assert again.info.serial_number == "EMU00001"


def test_it_takes_over_a_session_that_was_left_open(witness: Any) -> None:
    with served(True, "terminal") as opened:
        dead = witness.MicroScribe(opened(), allow_untested_models=True)
        dead.connect()
        dead.home()
        dead.hci.ser.close()
        with witness.MicroScribe(opened(), allow_untested_models=True) as arm:
            assert arm.info.model_name == "DX"
