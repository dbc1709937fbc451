import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from devices.microscribe.emulator.emulator_client import MicroScribeEmulator
from devices.port import DeviceError
from devices.pose import read_only_rigid
from devices.recording.path_file import save_probe_path
from devices.recording.probe_path import ProbePath

pytestmark = pytest.mark.skipif(
    sys.platform == "win32", reason="pseudo-terminals need POSIX"
)

ARGUMENTS = [
    sys.executable,
    "-W",
    "error",
    "-m",
    "devices.microscribe.emulator.process",
]


@pytest.fixture
def path_file(tmp_path: Path, short_path: ProbePath) -> Path:
    file = tmp_path / "p.path.json"
    save_probe_path(short_path, file)
    return file


def _asked(path_file: Path) -> str:
    return json.dumps({"path": str(path_file), "profile": "dx"})


def _gone(process: int) -> bool:
    for _ in range(300):
        try:
            os.kill(process, 0)
        except ProcessLookupError:
            return True
        time.sleep(0.01)
    return False


def _renamed(emulator: MicroScribeEmulator, first: str) -> str:
    for _ in range(1000):
        (name,) = emulator.names()
        if name != first:
            return name
        time.sleep(0.01)
    raise AssertionError(f"the arm was not plugged in anew within 10 s, it is {first}")


def test_the_child_tells_its_port_and_stops(path_file: Path) -> None:
    with MicroScribeEmulator(path_file, profile="nominal") as emulator:
        assert Path(emulator.port_name).exists()
        states = [emulator.running]
        read_only_rigid(emulator.device_from_world, "device_from_world")
    states.append(emulator.running)
    assert states == [True, False]
    emulator.close()


def test_it_is_handled_while_it_runs(path_file: Path) -> None:
    with MicroScribeEmulator(path_file, profile="dx") as emulator:
        first = emulator.port_name
        with pytest.raises(ValueError, match="nearest is 'unplug'"):
            emulator.do("unplugg")
        emulator.do("unplug")
        emulator.do("replug")
        assert _renamed(emulator, first) == emulator.port_name
        assert Path(emulator.port_name).exists()
        assert emulator.running


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"path": "nowhere.path.json"}, "cannot be read"),
        ({"faults": ["nonsense@1"]}, "fault"),
        ({"actions": ["fly@1"]}, "action must be one of"),
        ({"fiducials_mm": np.array([[5000.0, 0.0, 0.0]])}, "no place for the arm"),
    ],
)
def test_a_child_that_cannot_start_says_why(
    path_file: Path, change: dict[str, object], message: str
) -> None:
    options: dict[str, Any] = {"path": path_file, **change}
    with pytest.raises(DeviceError, match=message):
        MicroScribeEmulator(**options)


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_signals_end_it_well(path_file: Path, number: int) -> None:
    with subprocess.Popen(
        [*ARGUMENTS, _asked(path_file)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    ) as child:
        assert child.stdout is not None
        assert child.stderr is not None
        assert child.stdout.readline().startswith(b'{"port"')
        child.send_signal(number)
        assert child.wait(5.0) == 0
        assert child.stderr.read() == b""


def test_it_does_not_outlive_a_killed_parent(path_file: Path) -> None:
    command = [*ARGUMENTS, _asked(path_file)]
    parent_code = (
        "import subprocess, sys, time\n"
        f"c = subprocess.Popen({command!r}, stdin=subprocess.PIPE,"
        " stdout=subprocess.PIPE)\n"
        "c.stdout.readline(); print(c.pid, flush=True); time.sleep(60)\n"
    )
    with subprocess.Popen(
        [sys.executable, "-c", parent_code], stdout=subprocess.PIPE
    ) as parent:
        assert parent.stdout is not None
        child = int(parent.stdout.readline())
        parent.kill()
    assert _gone(child)
