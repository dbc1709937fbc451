"""A head in a closed loop of simulated time, before a plain wall."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from devices.haptics.force_port import new_guard
from devices.haptics.force_records import READING
from devices.haptics.kernels.guard_force import guard_force, hear_pose
from devices.haptics.kernels.step_head import command_probe, read_probe
from devices.haptics.mock_head import MockHead

START_NS = 10**9
PERIOD_NS = 10**6

Force = Callable[[NDArray[np.float64]], NDArray[np.float64]]


def wall(stiffness_n_m: float, at_mm: float = 0.0) -> Force:
    """Push along +z below a height."""

    def force(tip_mm: NDArray[np.float64]) -> NDArray[np.float64]:
        depth_mm = max(at_mm - tip_mm[2], 0.0)
        return np.array([0.0, 0.0, 1e-3 * stiffness_n_m * depth_mm])

    return force


def place(*tip_mm: float) -> NDArray[np.float64]:
    """Give an upright pose."""
    pose = np.eye(4)
    pose[:3, 3] = tip_mm
    return pose


@dataclass
class Bench:
    """Tick a head, its guard and a force, at even moments or at given ones."""

    head: MockHead
    force: Force
    ramp_s: float = 0.0
    now_ns: int = START_NS
    tips: list[NDArray[np.float64]] = field(default_factory=list)
    told: list[NDArray[np.float64]] = field(default_factory=list)
    faults: list[int] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.guard = new_guard(self.head.limits, self.ramp_s)
        self.reading = np.zeros(1, READING)

    def tick(self, count: int = 1, period_ns: int = PERIOD_NS) -> None:
        """Go on by so many ticks."""
        for _ in range(count):
            state, guard = self.head.state[0], self.guard[0]
            status = read_probe(state, self.reading[0], self.now_ns)
            force = np.zeros(3)
            if hear_pose(guard, status, self.reading[0], self.now_ns):
                force = self.force(self.reading["position_mm"][0])
            guard_force(guard, force, self.now_ns)
            command_probe(state, force[0], force[1], force[2], self.now_ns)
            self.tips.append(state["position_mm"].copy())
            self.told.append(force)
            self.faults.append(int(guard["fault"]))
            self.now_ns += period_ns

    @property
    def sizes(self) -> NDArray[np.float64]:
        """The sizes of all forces that the device was told, N."""
        sizes: NDArray[np.float64] = np.linalg.norm(np.array(self.told), axis=1)
        return sizes
