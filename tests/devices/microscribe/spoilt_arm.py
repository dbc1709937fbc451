"""A link to an arm whose answers a test may change on their way."""

from collections.abc import Callable
from dataclasses import replace

from devices.microscribe.emulator.answer import Answer
from devices.microscribe.emulator.emulated_arm import EmulatedArm
from devices.microscribe.emulator.faults.catalogue import FaultPlan
from devices.microscribe.emulator.faults.fault import EVERY_KIND, Fault
from devices.microscribe.emulator.faults.schedule import Schedule
from devices.microscribe.emulator.in_memory import MemoryLine
from devices.microscribe.emulator.motion import StillMotion
from devices.microscribe.kinematics.profiles import DX40937, ArmProfile
from devices.microscribe.wire.link import ArmLink


def spoilt_link(
    spoil: Callable[[bytes], bytes] = bytes, profile: ArmProfile = DX40937
) -> ArmLink:
    """Sign on to an arm whose every answer passes through a function."""

    class Spoilt(Fault):
        id = word = "spoilt"
        lasts = True
        kinds = EVERY_KIND

        def spoil(self, answer: Answer, arm: object, now_s: float) -> list[Answer]:
            return [replace(answer, data=spoil(answer.data))]

    plans = [FaultPlan(Spoilt, "", Schedule())]
    line = MemoryLine(EmulatedArm(profile, StillMotion(profile), faults=plans))
    link = ArmLink(line.open_port(), clock=line.clock)
    link.sign_on((115200,))
    return link
