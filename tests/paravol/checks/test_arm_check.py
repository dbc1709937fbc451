import json
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import cast

import numpy as np
import pytest
from numpy.typing import NDArray

from app.__main__ import main
from app.cli.doctor import run_arm_check
from devices import Pose
from devices.microscribe import MicroScribe
from devices.microscribe.driver.supervisor import ArmSettings, ConnectionSupervisor
from devices.microscribe.emulator.emulated_arm import EmulatedArm
from devices.microscribe.emulator.in_memory import DrivenClock, MemoryLine
from devices.microscribe.emulator.motion import AnglesMotion, StillMotion
from devices.microscribe.emulator.server import EmulatorServer
from devices.microscribe.emulator.terminal_port import TerminalPort
from devices.microscribe.kinematics.arm import ArmGeometry
from devices.microscribe.kinematics.profiles import DX40937, ArmProfile, profile_named
from devices.microscribe.wire.link import ArmDescription
from devices.microscribe.wire.sign_on import RATES
from devices.port import DeviceError, DeviceReason
from paravol.checks import arm_check
from paravol.checks.arm_check import (
    PATIENCE_S,
    adapter_findings,
    check_arm,
    line_findings,
    longest_poses_hz,
    pedals_finding,
    tip_finding,
)
from paravol.checks.finding import Finding
from paravol.checks.known_constants import constants_findings, require_known_constants
from tests.devices.driven_arm import DrivenArm
from tests.devices.microscribe.rare_faults import parse_any_fault

PERIODS_S = np.array([3.0, 4.0, 5.0, 2.5, 3.5, 9.0])


class Guide:
    def __init__(self) -> None:
        self.said: list[str] = []
        self.shares: list[float] = []

    def __call__(self, stage: str, share: float) -> None:
        self.shares.append(share)

    def say(self, text: str) -> None:
        self.said.append(text)


def waved(profile: ArmProfile, moves: NDArray[np.bool_]) -> AnglesMotion:
    """A hand that swings those joints a fifth of a radian to either side."""
    rest = profile.encoders.angles(np.array(profile.home_counts))
    joints = 6 if profile.encoders.turn[5] > 1 else 5

    def angles(t_s: float) -> NDArray[np.float64]:
        swing = 0.2 * np.sin(2.0 * np.pi * t_s / PERIODS_S)
        return np.asarray(rest + moves * swing)[:joints]

    return AnglesMotion(profile, angles)


def look(
    *faults: str,
    still: tuple[int, ...] = (),
    profile: ArmProfile = DX40937,
    guide: Guide | None = None,
) -> dict[str, Finding]:
    """Look at an arm whose joints are waved, but for those that stand ``still``."""
    motion = waved(profile, np.array([joint not in still for joint in range(6)]))
    plans = [parse_any_fault(fault) for fault in faults]
    emulated = EmulatedArm(profile, motion, faults=plans)
    arm = DrivenArm(MemoryLine(emulated, DrivenClock()))
    found = check_arm(cast(MicroScribe, arm), guide or Guide(), 12.0)
    return {finding.name: finding for finding in found}


@pytest.mark.parametrize("name", ["dx40937", "6dof"])
def test_an_arm_that_is_well(name: str) -> None:
    guide = Guide()
    profile = profile_named(name)
    found = look(profile=profile, guide=guide)
    assert profile.identity.serial in found["arm"].value
    assert "no faults" in found["line"].value
    assert found["encoders"].value.startswith("all count; travel ")
    joints = found["encoders"].value.partition("travel ")[2].split()[:-1]
    # two tenths of a radian to either side, in counts
    turns = [turn for turn in profile.encoders.turn if turn > 1]
    expected = [round(0.4 * turn / (2.0 * np.pi)) for turn in turns]
    assert np.abs(np.array(joints, dtype=int) - expected).max() <= 2
    assert [f.name for f in found.values() if f.is_missing or f.remedy] == [
        "home position",
        "pedals",
    ]
    assert "every joint" in guide.said[0]
    assert np.all(np.diff(guide.shares) >= 0.0)
    assert guide.shares[-1] == 1.0


@pytest.mark.parametrize("joint", range(5))
def test_a_dead_encoder_is_found(joint: int) -> None:
    found = look(f"f27=DEAD{joint}")
    assert found["encoders"].value.startswith(f"no counts from joint {joint + 1} (")
    assert [f.name for f in found.values() if f.is_missing] == ["encoders"]


def test_all_at_rest_is_no_illness() -> None:
    """Nothing can be said of an encoder while the whole arm stands still."""
    found = look(still=(0, 1, 2, 3, 4, 5))["encoders"]
    assert found.value.startswith("not moved: joint 1, 2, 3, 4, 5 (")
    assert not found.is_missing
    assert "look again" in found.remedy


def test_what_the_line_damaged_is_told() -> None:
    found = look("f8@packet:200+5")["line"]
    assert "no faults" not in found.value
    assert found.remedy


def test_clocks_that_agree_to_some_hundred_ppm_are_well() -> None:
    found = look()["clock"]
    assert int(found.value.split(" runs ")[1].split(" ppm")[0]) < 300
    assert found.remedy == ""


def test_where_there_is_no_arm_it_says_so(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(DeviceError, match="nowhere"):
        run_arm_check("/dev/nowhere", as_json=True)
    assert capsys.readouterr().out == ""


@pytest.mark.skipif(sys.platform == "win32", reason="pseudo-terminals need POSIX")
@pytest.mark.parametrize("fault", [[], ["f27=DEAD1"]])
def test_an_arm_at_a_port_is_told_of_in_full(
    fault: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    """In a second nobody can tell a dead encoder from one that was not moved."""
    plans = [parse_any_fault(name) for name in fault]
    motion = waved(DX40937, np.ones(6, dtype=bool))
    arm = EmulatedArm(DX40937, motion, faults=plans, now_s=time.monotonic())
    with EmulatorServer(arm, TerminalPort()) as server:
        assert run_arm_check(server.port_name, as_json=True, look_s=1.0) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["missing"] == []
    told = {finding["name"]: finding["value"] for finding in report["findings"]}
    assert set(told) == {
        *("arm", "constants", "constants since", "home position", "rate", "poses"),
        *("round trip", "tip", "pedals", "line", "clock", "encoders"),
    }
    assert told["rate"] == "115200 baud"
    assert told["home position"] == "assumed"
    assert told["encoders"].startswith("not moved" if fault else "all count")
    assert int(told["poses"].split()[0]) > 20


class Timeless(AnglesMotion):
    """A hand on an arm whose timer is set to zero whenever it is read."""

    arm: EmulatedArm

    def latch(self, now_s: float) -> tuple[tuple[int, ...], int]:
        self.arm.firmware.timer_zero_s = now_s
        return super().latch(now_s)


def test_a_timer_that_stands_still_ends_the_look() -> None:
    rest = DX40937.encoders.angles(np.array(DX40937.home_counts))
    motion = Timeless(DX40937, lambda t_s: rest[:5] + 0.05 * np.sin(t_s))
    motion.arm = EmulatedArm(DX40937, motion)
    clock = DrivenClock()
    arm = DrivenArm(MemoryLine(motion.arm, clock))
    findings = check_arm(cast(MicroScribe, arm), Guide(), 3.0, clock.now)
    found = {finding.name: finding for finding in findings}
    assert clock.now() < 3.0 + 2.0 * PATIENCE_S
    assert "stands still: 0.0 s of it in 8.0 s" in found["clock"].value
    assert found["clock"].is_missing


@pytest.fixture
def own_data(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    return tmp_path


def test_an_arm_is_remembered_and_a_change_told(own_data: Path) -> None:
    before = ArmDescription(DX40937.identity, DX40937.maxima, DX40937.geometry)

    def history(arm: ArmDescription, *, accept: bool = False) -> Finding:
        shown, since = constants_findings(arm, "/dev/arm", accept=accept)
        assert f"{arm.geometry.a_mm[2]:.2f}" in shown.value
        assert "16384 16384 8192 4096 4096 1 counts per turn" in shown.value
        return since

    assert "first time" in history(before).value
    assert history(before).value.startswith("unchanged since 20")
    require_known_constants(before, "/dev/arm")
    # one bit of one angle, too small for any bound
    words = list(DX40937.dh_words)
    words[3] ^= 1
    after = replace(before, geometry=ArmGeometry.from_words(tuple(words), 3))
    changed = history(after)
    assert changed.is_missing
    assert "alpha 3 was 89.852 and is 89.846 degrees" in changed.value
    assert "--accept-constants" in changed.remedy
    with pytest.raises(DeviceError, match="changed since") as caught:
        require_known_constants(after, "/dev/arm")
    assert caught.value.reason is DeviceReason.CONSTANTS
    # told again and again until somebody vouches for it
    assert history(after).is_missing
    assert "accepted" in history(after, accept=True).value
    assert not history(after).is_missing
    require_known_constants(after, "/dev/arm")
    assert history(before).is_missing


def test_an_unusual_arm_is_not_remembered(own_data: Path) -> None:
    words = list(DX40937.dh_words)
    words[8] += 256
    geometry = ArmGeometry.from_words(tuple(words), 3)
    arm = ArmDescription(DX40937.identity, DX40937.maxima, geometry)
    with pytest.raises(DeviceError, match=r"a 2 is 267\.00 mm"):
        require_known_constants(arm, "/dev/arm")
    assert not list(own_data.rglob("*.json"))
    assert constants_findings(arm, "/dev/arm", accept=False)[1].is_missing


def test_where_nothing_can_be_kept_the_arm_is_used(own_data: Path) -> None:
    (own_data / "paravol").write_text("no folder")
    arm = ArmDescription(DX40937.identity, DX40937.maxima, DX40937.geometry)
    require_known_constants(arm, "/dev/arm")
    told = constants_findings(arm, "/dev/arm", accept=False)[1]
    assert told.value == "nothing is known"
    assert str(own_data) in told.remedy


def test_constants_are_accepted_of_an_arm_only(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["doctor", "--accept-constants"]) == 1
    assert "needs --device" in capsys.readouterr().err


def test_a_fast_line_is_told_without_a_remedy() -> None:
    found = line_findings(115200, 0.0035, 99.6)
    assert [(f.name, f.value) for f in found] == [
        ("rate", "115200 baud"),
        ("poses", "100 per second"),
        (
            "round trip",
            "3.5 ms from a poll to its pose; the line and the arm need 2.5 ms",
        ),
    ]
    assert not any(f.remedy for f in found)


def test_9600_baud_is_said_to_carry_no_more() -> None:
    rate, poses, _ = line_findings(9600, 0.0195, 51.0)
    assert rate.value == "9600 baud"
    assert "did not answer at 115200" in rate.remedy
    assert "17 bytes of 10 bits" in rate.remedy
    assert "9600 baud carry 53 poses per second at most, 115200 baud 404" in rate.remedy
    assert "9600 baud carries no more" in poses.remedy


def test_what_9600_baud_carries_is_what_an_arm_there_brings() -> None:
    """The emulated arm at the slowest rate, with no other delay."""
    plans = [parse_any_fault("f2=9600")]
    line = MemoryLine(EmulatedArm(DX40937, StillMotion(DX40937), faults=plans))
    settings = ArmSettings(rates=(9600,), poll_hz=1000.0)
    supervisor = ConnectionSupervisor(line.open_port(), settings, None, line.clock)
    began, poses = line.clock.now(), 0
    while line.clock.now() < began + 5.0:
        poses += len(supervisor.step())
    assert supervisor.link.baud == 9600
    assert 0.93 * longest_poses_hz(9600) < poses / 5.0 <= longest_poses_hz(9600)
    assert supervisor.link.round_trip_s == pytest.approx(
        1.0 / longest_poses_hz(9600), rel=0.1
    )


def test_a_fast_line_that_brings_few_poses_is_held_up_elsewhere() -> None:
    _, poses, _ = line_findings(115200, 0.017, 58.0)
    assert "adapter" in poses.remedy


@pytest.mark.parametrize("baud", RATES)
def test_every_rate_carries_some_poses(baud: int) -> None:
    assert longest_poses_hz(baud) == pytest.approx(1.0 / (170.0 / baud + 0.001))


@pytest.mark.parametrize(("timer", "has_remedy"), [(16, True), (1, False)])
def test_a_latency_timer_is_told_with_how_to_set_it(
    timer: int, has_remedy: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(arm_check, "latency_ms", lambda name: timer)
    (found,) = adapter_findings("/dev/ttyUSB0")
    assert found.value == f"latency timer {timer} ms"
    assert ("ttyUSB0/latency_timer" in found.remedy) is has_remedy


def test_no_timer_no_finding() -> None:
    assert adapter_findings("/dev/ttyNOTHING") == []


def test_the_tip_is_told_in_the_arms_frame() -> None:
    frame = np.eye(4)
    frame[:3, 3] = (54.1966, -51.8427, 212.2005)
    assert tip_finding(Pose(0.0, 0.0, frame, 0)).value.startswith("54.2 -51.8 212.2 mm")


@pytest.mark.parametrize(
    ("built_in", "pressed", "told", "remedy"),
    [
        (3, 3, "right and left; pressed: right and left", ""),
        (3, 1, "right and left; pressed: right", "the left one"),
        (3, 0, "right and left; pressed: none", "the right and left one"),
        (1, 1, "right; pressed: right", ""),
        (0, 0, "the arm states none", "need one"),
    ],
)
def test_pedals_are_told_by_what_was_pressed(
    built_in: int, pressed: int, told: str, remedy: str
) -> None:
    found = pedals_finding(replace(DX40937.maxima, buttons=built_in), pressed)
    assert found.value == told
    assert remedy in found.remedy
    assert bool(found.remedy) is bool(remedy)
