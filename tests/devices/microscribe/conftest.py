"""A rehearsed arm: the driver's blocking half on an emulated line, nobody sleeps."""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
import pytest
from numpy.typing import NDArray

from devices.microscribe.driver.driver import SerialPort
from devices.microscribe.driver.sampler import MotionReports
from devices.microscribe.driver.supervisor import ArmSettings, ConnectionSupervisor
from devices.microscribe.emulator.emulated_arm import ArmTraits, EmulatedArm, LiveMotion
from devices.microscribe.emulator.in_memory import DrivenClock, MemoryLine
from devices.microscribe.emulator.motion import AnglesMotion, StillMotion
from devices.microscribe.kinematics.forward import ForwardKinematics
from devices.microscribe.kinematics.profiles import DX40937, ArmProfile
from devices.microscribe.wire.protocol import HostSession, State
from devices.port import DeviceError, DeviceReason
from devices.pose import Pose
from tests.devices.microscribe.rare_faults import parse_any_fault

# A bytes literal, a dataclass, the name of a member of an enumeration.
PYTHON = re.compile(r"\bb['\"]|\w\(\w+=|[A-Z]{2,}_[A-Z]|\\x")


class TappedPort(SerialPort):
    """A port that remembers what was written and that it was closed."""

    written: list[bytes]
    closed = False

    def write(self, data: bytes) -> None:
        self.written.append(data)
        super().write(data)

    def close(self) -> None:
        self.closed = True
        super().close()


@dataclass
class Rehearsal:
    """One emulated arm on a clock that only the driver's waiting moves."""

    line: MemoryLine
    motion: StillMotion
    reports: MotionReports | None
    written: list[bytes] = field(default_factory=list)
    opened: list[TappedPort] = field(default_factory=list)
    poses: list[Pose] = field(default_factory=list)
    fault: str = ""

    def names(self) -> Sequence[str]:
        if not self.line.arm.plugged:
            # Nobody reads, and only reading lets the arm's time pass.
            self.line.arm.speak(self.line.clock.now())
        return [self.line.name] if self.line.arm.plugged else []

    def open(self, name: str) -> TappedPort:
        if name != self.line.name or not self.line.arm.plugged:
            raise DeviceError(DeviceReason.NO_PORT, f"There is no {name}.")
        port = TappedPort(name, self.line.open_serial())
        port.written = self.written
        self.opened.append(port)
        return port

    def connect(
        self, settings: ArmSettings | None = None, *, replug: bool = False
    ) -> ConnectionSupervisor:
        chosen = settings or ArmSettings(rates=(115200,), reports=self.reports)
        port = self.open(self.line.name)
        finder = self if replug else None
        return ConnectionSupervisor(port, chosen, finder, self.line.clock)

    def run(self, supervisor: ConnectionSupervisor, seconds: float) -> list[Pose]:
        """Step for that long; return the poses of this stretch."""
        clock = self.line.clock
        assert isinstance(clock, DrivenClock)
        until = clock.now() + seconds
        poses: list[Pose] = []
        while clock.now() < until:
            poses += supervisor.step()
            clock.sleep_until(min(supervisor.due_s, until))
        self.poses += poses
        return poses

    def off_mm(self, poses: list[Pose]) -> list[float]:
        """How far each pose is from where the arm stands still."""
        profile = self.line.arm.profile
        forward = ForwardKinematics(profile.geometry, profile.encoders)
        tip = forward.device_from_tip(np.array(profile.home_counts))[:3, 3]
        return [float(np.linalg.norm(pose.tip_mm - tip)) for pose in poses]

    def steady(self, poses: list[Pose]) -> None:
        """Every pose is the still arm's, times rise, no harm was done."""
        assert max(self.off_mm(poses)) < 1e-9
        assert (np.diff([pose.time_s for pose in poses]) > 0.0).all()
        assert (np.diff([pose.host_time_s for pose in poses]) >= 0.0).all()
        memory_writes = (0xC3, 0xC7, 0xD0, 0xD1, 0x43, 0x47, 0x50, 0x51)
        assert not [data for data in self.written if data[0] in memory_writes]
        assert self.motion.homed == 0

    def refused(self, reason: DeviceReason, rates: tuple[int, ...]) -> DeviceError:
        """Opening must fail, in one sentence and without leaving the port open."""
        with pytest.raises(DeviceError) as caught:
            self.connect(ArmSettings(rates=rates, reports=self.reports))
        text = str(caught.value)
        assert caught.value.reason is reason
        assert text.endswith(".")
        assert "\n" not in text
        assert not PYTHON.search(text), text
        assert self.opened[0].closed
        return caught.value


def _waving(profile: ArmProfile) -> AnglesMotion:
    """A hand that moves every joint a little."""
    turn = np.array(profile.encoders.turn)
    rest = np.array(profile.home_counts) * (2.0 * np.pi / turn)
    periods_s = np.array([3.0, 4.0, 5.0, 2.5, 3.5, 9.0])

    def angles(t_s: float) -> NDArray[np.float64]:
        swing = 0.2 * np.sin(2.0 * np.pi * t_s / periods_s)
        return np.asarray(rest + swing)[:5]

    return AnglesMotion(profile, angles)


def idle_session(confirmed_only: bool = False) -> HostSession:
    """A host's session that has just been opened."""
    session = HostSession(confirmed_only=confirmed_only)
    session.clear()
    session.sign_on()
    session.receive(b"IMMC")
    session.begin()
    session.receive(b"MSCR\0")
    assert session.state is State.IDLE
    return session


@pytest.fixture
def rehearse() -> Callable[..., Rehearsal]:
    """Make a function that sets up an arm with faults."""

    def make(
        *faults: str,
        profile: ArmProfile = DX40937,
        waving: bool = False,
        reports: MotionReports | None = None,
        seed: int = 1,
    ) -> Rehearsal:
        still = StillMotion(profile)
        motion: LiveMotion = _waving(profile) if waving else still
        plans = [parse_any_fault(fault) for fault in faults]
        arm = EmulatedArm(profile, motion, faults=plans, traits=ArmTraits(seed=seed))
        return Rehearsal(MemoryLine(arm), still, reports, fault=" ".join(faults))

    return make
