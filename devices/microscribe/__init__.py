"""A MicroScribe digitizer arm: its driver, its emulator."""

from devices.microscribe.driver import MicroScribe
from devices.microscribe.emulator_client import MicroScribeEmulator

__all__ = ["MicroScribe", "MicroScribeEmulator"]
