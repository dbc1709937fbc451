"""The driver's blocking half on an emulated line whose time the reader moves."""

from collections import deque

from devices import Pose
from devices.microscribe.driver.sampler import HomeState
from devices.microscribe.driver.supervisor import ArmSettings, ConnectionSupervisor
from devices.microscribe.emulator.in_memory import DrivenClock, MemoryLine
from devices.microscribe.wire.link import ArmDescription

PERIOD_S = 0.01


class DrivenArm:
    """What `MicroScribe` shows of an arm, without its thread and without waiting."""

    def __init__(self, line: MemoryLine) -> None:
        clock = line.clock
        assert isinstance(clock, DrivenClock)
        self._clock = clock
        settings = ArmSettings(rates=(115200,), poll_hz=1.0 / PERIOD_S)
        self._supervisor = ConnectionSupervisor(line.open_port(), settings, None, clock)
        self._poses: deque[Pose] = deque()

    @property
    def description(self) -> ArmDescription:
        return self._supervisor.sampler.description

    @property
    def home_state(self) -> HomeState:
        return self._supervisor.sampler.home_state

    @property
    def counts(self) -> tuple[int, ...]:
        return self._supervisor.sampler.tracker.counts

    @property
    def frozen_joints(self) -> tuple[int, ...]:
        return self._supervisor.sampler.tracker.watch.frozen

    @property
    def clock_drift(self) -> float:
        return self._supervisor.sampler.tracker.alignment.drift

    @property
    def baud(self) -> int:
        return self._supervisor.link.baud

    @property
    def round_trip_s(self) -> float:
        return self._supervisor.link.round_trip_s

    @property
    def counters(self) -> dict[str, int]:
        return self._supervisor.counters

    def read(self, timeout_s: float) -> Pose:
        until = self._clock.now() + timeout_s
        while not self._poses:
            if self._clock.now() > until:
                raise TimeoutError("the arm said nothing")
            self._poses += self._supervisor.step()
            self._clock.sleep_until(self._supervisor.due_s)
        return self._poses.popleft()
