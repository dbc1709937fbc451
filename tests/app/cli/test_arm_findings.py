"""The line of an arm in figures, and why it is slow where it is."""

from dataclasses import replace

import numpy as np
import pytest

from app.cli import arm_findings
from app.cli.arm_findings import (
    adapter_findings,
    line_findings,
    longest_poses_hz,
    pedals_finding,
    tip_finding,
)
from devices import Pose
from devices.microscribe.driver.supervisor import ArmSettings, ConnectionSupervisor
from devices.microscribe.emulator.emulated_arm import EmulatedArm
from devices.microscribe.emulator.in_memory import MemoryLine
from devices.microscribe.emulator.motion import StillMotion
from devices.microscribe.kinematics.profiles import DX40937
from devices.microscribe.wire.sign_on import RATES
from tests.devices.microscribe.rare_faults.every_fault import parse_any_fault


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
    monkeypatch.setattr(arm_findings, "latency_ms", lambda name: timer)
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
