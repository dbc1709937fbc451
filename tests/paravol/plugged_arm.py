"""An emulated arm on a port that may be pulled out and put in."""

import time

from devices.microscribe.emulator.emulated_arm import EmulatedArm
from devices.microscribe.emulator.in_memory import EmulatedPort, MemoryLine, SystemClock
from devices.microscribe.emulator.motion import StillMotion
from devices.microscribe.kinematics.profiles import DX40937

RIGHT = 1
"""The right pedal, as a pose tells it."""


class Plug:
    """A machine with one emulated arm, whose plug and pedal a person moves."""

    def __init__(self) -> None:
        self.motion = StillMotion(DX40937)
        arm = EmulatedArm(DX40937, self.motion, now_s=time.monotonic())
        self.line = MemoryLine(arm, SystemClock())

    def names(self) -> list[str]:
        return [self.line.name] if self.line.arm.plugged else []

    def open(self, name: str) -> EmulatedPort:
        return self.line.open_port()

    def move(self, is_in: bool) -> None:
        arm = self.line.arm
        with self.line.changed:
            (arm.replug if is_in else arm.unplug)(time.monotonic())
            self.line.changed.notify_all()

    def press(self) -> None:
        self.motion.buttons = RIGHT
        time.sleep(0.6)
        self.motion.buttons = 0
        time.sleep(0.3)
