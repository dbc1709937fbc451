"""A MicroScribe digitizer arm: its driver, its emulator."""

from devices.microscribe.driver.driver import MicroScribe
from devices.microscribe.emulator.emulator_client import MicroScribeEmulator

__all__ = ["MicroScribe", "MicroScribeEmulator"]
