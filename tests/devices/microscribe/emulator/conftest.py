"""A client that talks to a faulty arm over memory, in no time."""

from collections.abc import Callable
from dataclasses import dataclass

import pytest

from devices.microscribe.emulator.emulated_arm import ArmTraits, EmulatedArm, LiveMotion
from devices.microscribe.emulator.in_memory import MemoryLine, MemorySerial
from devices.microscribe.emulator.motion import StillMotion
from devices.microscribe.kinematics.profiles import DX40937, ArmProfile
from tests.devices.microscribe.rare_faults import parse_any_fault

CLEAN = bytes.fromhex("83 00 6C 4F 30 5E 35 54 20 02 18 79 41 60")


@dataclass
class Client:
    """The least that a host does."""

    arm: EmulatedArm
    line: MemoryLine
    port: MemorySerial

    def ask(self, data: bytes, wait_s: float = 0.08) -> bytes:
        """Write ``data``; return all that comes within the wait."""
        self.port.timeout = wait_s
        self.port.write(data)
        return self.port.read(1000)

    def sign_on(self) -> bytes:
        """Sign on once; return what came from the first echo to the id."""
        return self.ask(b"\xc5IMMC") + self.ask(b"BEGIN")

    def poll(self, count: int = 1) -> list[bytes]:
        """Ask for packets of six encoders, every 0.1 s."""
        return [self.ask(b"\x03", 0.1) for _ in range(count)]

    def passes(self, seconds: float) -> None:
        """Let time pass."""
        self.line.clock.sleep(seconds)

    @property
    def now_s(self) -> float:
        """Get the time on the line's clock."""
        return self.line.clock.now()


@pytest.fixture
def connect() -> Callable[..., Client]:
    """Make a function that gives a client of an arm with faults."""

    def make(
        *faults: str,
        profile: ArmProfile = DX40937,
        motion: LiveMotion | None = None,
        seed: int = 0,
        baud: int = 115200,
    ) -> Client:
        plans = [parse_any_fault(text) for text in faults]
        arm = EmulatedArm(
            profile,
            motion or StillMotion(profile),
            faults=plans,
            traits=ArmTraits(seed=seed),
        )
        line = MemoryLine(arm)
        return Client(arm, line, line.open_serial(baud, timeout=0.1))

    return make


@pytest.fixture
def clean() -> bytes:
    """Give the packet of six encoders of an arm at rest."""
    return CLEAN
