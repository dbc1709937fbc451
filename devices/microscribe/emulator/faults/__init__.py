"""Thirty ways in which an arm, its line or its client go wrong, by name."""

from devices.microscribe.emulator.faults.catalogue import (
    FAULTS,
    SHORT_NAMES,
    FaultPlan,
    altered_profile,
    list_faults,
    make_faults,
    parse_fault,
)
from devices.microscribe.emulator.faults.fault import Fault
from devices.microscribe.emulator.faults.schedule import Schedule, parse_schedule

__all__ = [
    "FAULTS",
    "SHORT_NAMES",
    "Fault",
    "FaultPlan",
    "Schedule",
    "altered_profile",
    "list_faults",
    "make_faults",
    "parse_fault",
    "parse_schedule",
]
