"""Packets of one arm -> poses, without input or output.

Keeps what one packet does not know: how often counts and timer have wrapped, how fast
the arm was, when it was last believed.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from devices.microscribe.arm import (
    FIELD,
    JOINTS,
    ArmGeometry,
    Encoders,
    unwrap_counts,
)
from devices.microscribe.packets import Packet
from devices.pose import Pose, PoseFlag

TICKS_PER_S = 900.0

# A hand turns no joint faster. The gate catches flipped high bits of a packet without
# checksum; of the 70 possible flips in one packet 21 move the tip by less than 1 mm
# and pass: nothing on this line can catch those.
LARGEST_RATE_DEG_S = 720.0

# Two counts of rounding are no motion.
ALLOWED_COUNTS = 2

# After that many refusals the arm is believed: it was moved, not misread.
LARGEST_REFUSALS = 5

# A quartz drifts by microseconds and a packet is late by milliseconds; a timer that
# is off by half a second was set to zero.
POWER_CUT_S = 0.5


@dataclass(slots=True)
class SampleTracker:
    """Continuous counts, continuous time and a plausibility gate for one arm."""

    geometry: ArmGeometry
    encoders: Encoders
    timer_turn: int = FIELD
    refused: int = 0
    """Samples thrown away because a joint would have moved too fast."""
    jumps: int = 0
    """Poses delivered with PoseFlag.JUMP."""
    _ticks: int | None = None
    _host_time_s: float = 0.0
    _counts: NDArray[np.int64] = field(
        default_factory=lambda: np.zeros(JOINTS, dtype=np.int64)
    )
    _refusals: int = 0
    _turn: NDArray[np.int64] = field(init=False)
    _window: NDArray[np.int64] = field(init=False)
    """Steps are told apart modulo this many counts."""

    def __post_init__(self) -> None:
        self._turn = np.array(self.encoders.turn, dtype=np.int64)
        # Where whole turns fit into the field, the winding bits change no angle.
        self._window = np.where(FIELD % self._turn == 0, self._turn, FIELD)

    def accept(self, packet: Packet, host_time_s: float) -> Pose | None:
        """Return the pose of a packet with timer and six counts, or None if refused.

        ``host_time_s`` is the arrival of its header on the host's monotonic clock.
        """
        if packet.timer is None or len(packet.counts) != JOINTS:
            raise ValueError(f"a pose needs a timer and six counts, got {packet}")
        reading = np.array(packet.counts, dtype=np.int64)
        flags = PoseFlag.NONE
        if self._ticks is None:
            ticks, counts = packet.timer, reading
        else:
            ticks = self._ticks + self._ticks_since(packet.timer, host_time_s)
            counts = unwrap_counts(self._counts, reading)
            if not self._plausible(counts - self._counts, ticks - self._ticks):
                if self._refusals < LARGEST_REFUSALS:
                    self._refusals += 1
                    self.refused += 1
                    return None
                self.jumps += 1
                flags = PoseFlag.JUMP
        self._refusals = 0
        self._ticks, self._counts = ticks, counts
        self._host_time_s = host_time_s
        return Pose(
            time_s=ticks / TICKS_PER_S,
            host_time_s=host_time_s,
            device_from_tip=self.geometry.device_from_tip(self.encoders.angles(counts)),
            buttons=packet.buttons,
            flags=flags,
        )

    def forget(self) -> None:
        """Begin anew with the next sample, whose counts continue nothing."""
        self._ticks = None
        self._refusals = 0

    def lost_power(self, packet: Packet, host_time_s: float) -> bool:
        """Return whether the timer began anew since the last accepted sample."""
        if self._ticks is None or packet.timer is None:
            return False
        elapsed = (host_time_s - self._host_time_s) * TICKS_PER_S
        ahead = (packet.timer - self._ticks - elapsed) % self.timer_turn
        return min(ahead, self.timer_turn - ahead) > POWER_CUT_S * TICKS_PER_S

    def _ticks_since(self, timer: int, host_time_s: float) -> int:
        """Return ticks since the last sample; whole wraps come from the host's clock.

        The timer alone is ambiguous after 18.2 s of silence.
        """
        assert self._ticks is not None
        part = (timer - self._ticks) % self.timer_turn
        elapsed = (host_time_s - self._host_time_s) * TICKS_PER_S
        wraps = max(0, round((elapsed - part) / self.timer_turn))
        return part + wraps * self.timer_turn

    def _plausible(self, moved: NDArray[np.int64], ticks: int) -> bool:
        half = self._window // 2
        moved = (moved + half) % self._window - half
        allowed = self._turn * (LARGEST_RATE_DEG_S / 360.0) * (ticks / TICKS_PER_S)
        fits = np.abs(moved) <= allowed + ALLOWED_COUNTS
        return bool((fits | (self._turn == 1)).all())
