"""All thirty faults of the protocol's list and one more: the product's and the rare."""

from devices.microscribe.emulator.faults import FAULTS, FaultPlan, parse_fault
from devices.microscribe.emulator.faults.fault import Fault
from tests.devices.microscribe.rare_faults.description_faults import (
    BadMaxima,
    BadParameters,
    BadString,
    SilentBeta,
)
from tests.devices.microscribe.rare_faults.motion_faults import EncoderWrap, Pedals
from tests.devices.microscribe.rare_faults.packet_faults import DoubledByte, WrongTopBit
from tests.devices.microscribe.rare_faults.session_faults import (
    Loopback,
    MemoryWrite,
    StreamGoesOn,
    TimerWrap,
    Unhomed,
)
from tests.devices.microscribe.rare_faults.sign_on_faults import (
    EndEcho,
    LeftOpen,
    NoBegin,
    OneRate,
    SurplusEchoes,
    WrongId,
)
from tests.devices.microscribe.rare_faults.timing_faults import Chunks

RARE_FAULTS = (
    OneRate,
    SurplusEchoes,
    EndEcho,
    NoBegin,
    WrongId,
    LeftOpen,
    DoubledByte,
    WrongTopBit,
    Chunks,
    EncoderWrap,
    TimerWrap,
    BadString,
    BadParameters,
    BadMaxima,
    SilentBeta,
    Unhomed,
    Pedals,
    StreamGoesOn,
    Loopback,
    MemoryWrite,
)

EVERY_FAULT: tuple[type[Fault], ...] = (*FAULTS, *RARE_FAULTS)


def parse_any_fault(text: str) -> FaultPlan:
    """Read a fault of the product or a rare one."""
    return parse_fault(text, EVERY_FAULT)
