"""A point on which the stylus was held still."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from devices.pose import Pose
from system import UserError

# A tenth of a second of rest beside what the foot does to the hand.
FEWEST_POSES = 10

# A stylus that travels this far was not resting on anything.
LARGEST_TRAVEL_MM = 3.0

# Tremor is around 10 Hz: poses closer in time shake together and tell nothing new.
TREMOR_S = 0.1


class HoldReason(Enum):
    """Why a held point was refused."""

    TOO_SHORT = "held too briefly"
    SLIPPED = "the tip moved"


class HoldError(UserError):
    """Poses that do not say on which point the stylus was held."""

    def __init__(self, reason: HoldReason, message: str) -> None:
        super().__init__(message)
        self.reason = reason


@dataclass(frozen=True, slots=True, eq=False)
class HeldPoint:
    """Where a stylus rested, in the device's frame."""

    device_from_tip: NDArray[np.float64]
    """(4, 4) measured pose nearest to the middle, with its origin in the middle."""
    shake_mm: float
    """rms distance of the tip from its mean while it was held."""
    noise: NDArray[np.float64]
    """(3, 3) mm^2 covariance of the mean by shaking alone."""

    @property
    def tip_mm(self) -> NDArray[np.float64]:
        """Return the mean of the tip, (3,) mm."""
        return self.device_from_tip[:3, 3]

    @classmethod
    def of(cls, poses: Sequence[Pose], fewest: int = FEWEST_POSES) -> "HeldPoint":
        """Average the poses of one press.

        Pressing and releasing the pedal shakes the hand: the first and the last fifth
        are left out. Raise HoldError when fewer than ``fewest`` (2 or more) are left,
        or for a tip that travelled.
        """
        cut = len(poses) // 5
        still = poses[cut : len(poses) - cut]
        if len(still) < fewest:
            raise HoldError(
                HoldReason.TOO_SHORT,
                "The pedal was held too briefly; hold it for half a second.",
            )
        tips = np.array([pose.tip_mm for pose in still])
        mean = tips.mean(axis=0)
        off = np.linalg.norm(tips - mean, axis=1)
        if float(off.max()) > LARGEST_TRAVEL_MM:
            raise HoldError(
                HoldReason.SLIPPED,
                f"The tip moved by {off.max():.1f} mm while the pedal was down; rest "
                "it in the hole and press again.",
            )
        frame = still[int(np.argmin(off))].device_from_tip.copy()
        frame[:3, 3] = mean
        spread: NDArray[np.float64] = np.cov(tips.T)
        duration = still[-1].time_s - still[0].time_s
        independent = min(float(len(still)), 1.0 + duration / TREMOR_S)
        shake = float(np.sqrt(np.mean(off**2)))
        return cls(frame, shake, spread / independent)
