"""An emulated arm on a port that may be pulled out and put in."""

import time

from devices.microscribe.driver.driver import SerialPort
from devices.microscribe.emulator.emulated_arm import EmulatedArm
from devices.microscribe.emulator.faults.catalogue import parse_fault
from devices.microscribe.emulator.in_memory import MemoryLine
from devices.microscribe.emulator.motion import StillMotion
from devices.microscribe.kinematics.profiles import DX40937
from devices.port import DeviceError, DeviceReason, HostClock

RIGHT = 1
"""The right pedal, as a pose tells it."""


class Plug:
    """A machine with one emulated arm, whose plug and pedal a person moves."""

    def __init__(self, *faults: str) -> None:
        self.motion = StillMotion(DX40937)
        plans = [parse_fault(fault) for fault in faults]
        begun_s = time.monotonic()
        arm = EmulatedArm(DX40937, self.motion, faults=plans, now_s=begun_s)
        self.line = MemoryLine(arm, HostClock())

    def names(self) -> list[str]:
        return [self.line.name] if self.line.arm.plugged else []

    def open(self, name: str) -> SerialPort:
        if name != self.line.name:
            raise DeviceError(DeviceReason.NO_PORT, f"There is no {name}.")
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
