"""Rolls that a test sets, or that nobody knows."""

from dataclasses import dataclass

from devices.pose import Pose


@dataclass(slots=True)
class SetRoll:
    """A roll that was set; None where nobody knows it."""

    degrees: float | None = None

    def roll_deg(self, pose: Pose) -> float | None:
        return self.degrees
