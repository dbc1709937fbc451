"""Ways in which an arm or its line goes wrong, by name."""

from devices.microscribe.emulator.faults.catalogue import (
    FAULTS,
    FaultPlan,
    list_faults,
    make_faults,
    parse_fault,
)
from devices.microscribe.emulator.faults.schedule import parse_schedule

__all__ = [
    "FAULTS",
    "FaultPlan",
    "list_faults",
    "make_faults",
    "parse_fault",
    "parse_schedule",
]
