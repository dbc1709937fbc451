"""Paths and arms that several device tests share."""

import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np
import pytest
from numpy.typing import NDArray

from devices.microscribe.emulator.firmware import ArmFirmware
from devices.microscribe.kinematics.profiles import DX40937, HOME_COUNTS, ArmProfile
from devices.microscribe.wire.line import LinkTiming
from devices.port import DeviceError
from devices.recording.probe_path import ProbePath
from tests.devices.memory_port import MemoryPort, memory_port_pair


def _unit(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    unit: NDArray[np.float64] = vectors / np.linalg.norm(
        vectors, axis=-1, keepdims=True
    )
    return unit


@pytest.fixture
def short_path() -> ProbePath:
    """A second of motion through a nose-sized region."""
    count = 101
    s = np.linspace(0.0, 1.0, count)
    one = np.ones(count)
    axis = _unit(np.stack((0.1 * np.sin(5 * s), one, 0.5 * np.sin(4 * s)), axis=1))
    tip = np.stack((8 + 3 * np.sin(3 * s), -60 + 20 * s, 10 + 8 * np.sin(3 * s)), 1)
    return ProbePath(
        name="short",
        t_s=s,
        tip_mm=tip,
        axis=axis,
        roll_deg=40.0 * np.sin(3.0 * s),
        instrument_tip_mm=tip + np.array((2.0, 0.0, -3.0)),
        instrument_axis=axis,
        buttons=np.zeros(count, dtype=np.int64),
    )


@pytest.fixture
def hasty() -> LinkTiming:
    """Waits short enough for tests and long enough for a busy machine."""
    return LinkTiming(
        per_rate=0.25,
        forced_rate=0.3,
        surplus=0.2,
        begin=1.0,
        reply=0.3,
        string=0.4,
        block=0.4,
    )


@dataclass
class StillArm:
    """An arm that stands where it is put."""

    counts: tuple[int, ...] = HOME_COUNTS
    buttons: int = 0
    homed: int = 0

    def latch(self, now_s: float) -> tuple[tuple[int, ...], int]:
        return self.counts, self.buttons

    def home(self) -> None:
        self.homed += 1


@dataclass
class ServedArm:
    """A far end that a thread serves over memory, with the port to reach it."""

    port: MemoryPort
    far_port: MemoryPort
    firmware: ArmFirmware
    motion: StillArm
    spoil: Callable[[bytes], bytes] = bytes
    heard: bytearray = field(default_factory=bytearray)

    def serve(self) -> None:
        try:
            while True:
                data = self.far_port.read(1, 0.02)
                self.heard += data
                answer = self.firmware.receive(data, time.monotonic())
                self.far_port.write(self.spoil(answer))
        except DeviceError:
            return


@pytest.fixture
def serve_arm() -> Iterator[Callable[..., ServedArm]]:
    """Make a function that starts serving an arm."""
    served: list[tuple[ServedArm, threading.Thread]] = []

    def start(profile: ArmProfile = DX40937) -> ServedArm:
        near, far = memory_port_pair()
        motion = StillArm()
        arm = ServedArm(near, far, ArmFirmware(profile, motion, 0.0), motion)
        thread = threading.Thread(target=arm.serve)
        thread.start()
        served.append((arm, thread))
        return arm

    yield start
    for arm, thread in served:
        arm.far_port.close()
        thread.join()
