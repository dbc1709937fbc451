import json
import sys
import time

import numpy as np
import pytest
from numpy.typing import NDArray

from app.arm_check import check_arm, run_arm_check
from app.doctor import Finding
from devices.microscribe.emulator_arm import EmulatedArm
from devices.microscribe.emulator_faults import parse_fault
from devices.microscribe.emulator_memory import DrivenClock, MemoryLine
from devices.microscribe.emulator_motion import AnglesMotion
from devices.microscribe.emulator_server import EmulatorServer
from devices.microscribe.emulator_terminal import TerminalPort
from devices.microscribe.profiles import DX40937, ArmProfile, profile_named
from devices.port import DeviceError
from tests.devices.driven_arm import DrivenArm

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
    plans = [parse_fault(fault) for fault in faults]
    emulated = EmulatedArm(profile, motion, faults=plans)
    arm = DrivenArm(MemoryLine(emulated, DrivenClock()))
    found = check_arm(arm, guide or Guide(), 12.0)
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
    plans = [parse_fault(name) for name in fault]
    motion = waved(DX40937, np.ones(6, dtype=bool))
    arm = EmulatedArm(DX40937, motion, faults=plans, now_s=time.monotonic())
    with EmulatorServer(arm, TerminalPort()) as server:
        assert run_arm_check(server.port_name, as_json=True, look_s=1.0) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["missing"] == []
    told = {finding["name"]: finding["value"] for finding in report["findings"]}
    assert set(told) == {
        *("arm", "home position", "rate", "poses", "round trip", "tip", "pedals"),
        *("line", "clock", "encoders"),
    }
    assert told["rate"] == "115200 baud"
    assert told["home position"] == "assumed"
    assert told["encoders"].startswith("not moved" if fault else "all count")
    assert int(told["poses"].split()[0]) > 20
