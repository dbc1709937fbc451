"""The driver's blocking half on an emulated line whose time the reader moves."""

from collections import deque

from devices import Pose
from devices.microscribe.driver.driver import SupervisedArm
from devices.microscribe.driver.supervisor import ArmSettings, ConnectionSupervisor
from devices.microscribe.emulator.in_memory import DrivenClock, MemoryLine

PERIOD_S = 0.01


class DrivenArm(SupervisedArm):
    """What `MicroScribe` shows of an arm, without its thread and without waiting."""

    def __init__(self, line: MemoryLine) -> None:
        clock = line.clock
        assert isinstance(clock, DrivenClock)
        self._clock = clock
        settings = ArmSettings(rates=(115200,), poll_hz=1.0 / PERIOD_S)
        self._supervisor = ConnectionSupervisor(line.open_port(), settings, None, clock)
        self._poses: deque[Pose] = deque()

    def read(self, timeout_s: float) -> Pose:
        until = self._clock.now() + timeout_s
        while not self._poses:
            if self._clock.now() > until:
                raise TimeoutError("the arm said nothing")
            self._poses += self._supervisor.step()
            self._clock.sleep_until(self._supervisor.due_s)
        return self._poses.popleft()
