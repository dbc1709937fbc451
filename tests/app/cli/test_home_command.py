"""`paravol home`: it says what to do, asks, and homes only an arm it was told to."""

import io
import json
import sys
import time
from collections.abc import Iterator

import numpy as np
import pytest

from app.__main__ import main
from devices.microscribe.emulator.emulated_arm import EmulatedArm
from devices.microscribe.emulator.motion import StillMotion
from devices.microscribe.emulator.server import EmulatorServer
from devices.microscribe.emulator.terminal_port import TerminalPort
from devices.microscribe.kinematics.forward import ForwardKinematics
from devices.microscribe.kinematics.profiles import DX40937, HOME_COUNTS
from tests.devices.microscribe.rare_faults import parse_any_fault

pytestmark = pytest.mark.skipif(
    sys.platform == "win32", reason="pseudo-terminals need POSIX"
)

ELSEWHERE = (9000, 4000, 5000, 2000, 1000, 8416)


class Bench:
    def __init__(self, *faults: str) -> None:
        self.motion = StillMotion(DX40937, ELSEWHERE)
        plans = [parse_any_fault(fault) for fault in faults]
        arm = EmulatedArm(DX40937, self.motion, faults=plans, now_s=time.monotonic())
        self.server = EmulatorServer(arm, TerminalPort())


@pytest.fixture
def bench() -> Iterator[Bench]:
    made = Bench()
    with made.server:
        yield made


def _answer(monkeypatch: pytest.MonkeyPatch, text: str) -> None:
    monkeypatch.setattr(sys, "stdin", io.StringIO(text))


@pytest.mark.parametrize("answer", ["\n", "n\n", "yeah\n"])
def test_it_homes_nothing_without_a_plain_yes(
    bench: Bench,
    answer: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    _answer(monkeypatch, answer)
    assert main(["home", "--device", bench.server.port_name]) == 1
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.index("home position") < said.err.index("[y/N]")
    assert "was not homed" in said.err
    assert bench.motion.homed == 0


def test_nobody_there_homes_nothing(
    bench: Bench, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    _answer(monkeypatch, "")
    assert main(["home", "--device", bench.server.port_name]) == 1
    assert "give --yes" in capsys.readouterr().err
    assert bench.motion.homed == 0


@pytest.mark.parametrize(("words", "answer"), [([], "y\n"), (["--yes"], "")])
def test_a_yes_loads_the_home_counts_and_tells_the_tip(
    bench: Bench,
    words: list[str],
    answer: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    _answer(monkeypatch, answer)
    assert main(["home", "--device", bench.server.port_name, "--json", *words]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["serial"] == DX40937.identity.serial
    forward = ForwardKinematics(DX40937.geometry, DX40937.encoders)
    tip = forward.device_from_tip(np.array(HOME_COUNTS))[:3, 3]
    assert told["tip_mm"] == pytest.approx(tip.tolist(), abs=0.06)
    assert bench.motion.homed == 1
    # Loaded into the running arm, never into its memory.
    assert bench.server.arm.firmware.memory_writes == 0


def test_the_table_says_what_to_do_next(
    bench: Bench, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["home", "--device", bench.server.port_name, "--yes"]) == 0
    assert "register" in capsys.readouterr().out


def test_an_arm_that_waits_for_its_button_is_told_of(
    capsys: pytest.CaptureFixture[str],
) -> None:
    made = Bench("f24")
    with made.server:
        assert main(["home", "--device", made.server.port_name, "--yes"]) == 1
    assert "press its home button" in capsys.readouterr().err
