"""Packets of one arm -> poses, without input or output.

Keeps what one packet does not know: how often counts and timer have wrapped, how fast
the arm was, when it was last believed.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from devices.microscribe.driver.clock_alignment import TICKS_PER_S, ClockAlignment
from devices.microscribe.driver.encoder_watch import EncoderWatch
from devices.microscribe.kinematics.arm import FIELD, JOINTS, ArmGeometry, Encoders
from devices.microscribe.kinematics.forward import ForwardKinematics
from devices.microscribe.wire.packets import Packet
from devices.pose import Pose, PoseFlag
from system import UserError

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

# A packet cannot come before it was measured. How long packets travel at least is
# known after two seconds, then a timer that runs ahead by more was misread.
EARLIEST_S = 0.02

# The index pulse of a sixth encoder comes on this button line; it is no pedal.
_INDEX_PULSE = 0b100


@dataclass(slots=True)
class SampleTracker:
    """Continuous counts, continuous time and a plausibility gate for one arm."""

    geometry: ArmGeometry
    encoders: Encoders
    timer_turn: int = FIELD
    refused: int = 0
    """Samples thrown away because a joint or the timer would have been too fast."""
    jumps: int = 0
    """Poses delivered with PoseFlag.JUMP."""
    alignment: ClockAlignment = field(default_factory=ClockAlignment)
    watch: EncoderWatch = field(init=False)
    _timer: int | None = None
    """The last sample's own timer, None before the first."""
    _ticks: int = 0
    """The same continued over wraps and restarts; never falls."""
    _goes_on: bool = False
    """Whether the next sample's counts continue the last one's."""
    _host_time_s: float = 0.0
    _counts: NDArray[np.int64] = field(init=False)
    _reading: NDArray[np.int64] = field(init=False)
    """The newest packet's counts as they came."""
    _refusals: int = 0
    _forward: ForwardKinematics = field(init=False)
    _continue: Callable[..., bool] = field(init=False)
    _windows: NDArray[np.int64] = field(init=False)
    """Per joint: counts modulo which steps are told apart."""
    _fastest: NDArray[np.float64] = field(init=False)
    """Per joint: counts per tick."""
    _pedals: int = field(init=False)

    def __post_init__(self) -> None:
        # Imported here: this module's names are needed where nothing is compiled.
        from devices.microscribe.kernels.continue_counts import continue_counts

        self._continue = continue_counts
        turns = self.encoders.turn
        self._counts = np.zeros(JOINTS, dtype=np.int64)
        self._reading = self._counts.copy()
        self.watch = EncoderWatch([turn > 1 for turn in turns])
        self._forward = ForwardKinematics(self.geometry, self.encoders)
        self._pedals = ~_INDEX_PULSE if turns[5] > 1 else ~0
        per_tick = LARGEST_RATE_DEG_S / 360.0 / TICKS_PER_S
        # Where whole turns fit into the field, the winding bits change no angle.
        self._windows = np.array(
            [turn if turn > 1 and FIELD % turn == 0 else FIELD for turn in turns]
        )
        # What a joint without encoder sends is nobody's motion.
        self._fastest = np.array(
            [turn * per_tick if turn > 1 else float("inf") for turn in turns]
        )

    @property
    def counts(self) -> tuple[int, ...]:
        """Return the unwrapped counts of the last accepted sample."""
        return tuple(self._counts.tolist())

    def accept(self, packet: Packet, host_time_s: float) -> Pose | None:
        """Return the pose of a packet with timer and six counts, or None if refused.

        ``host_time_s`` is the arrival of its header on the host's monotonic clock.
        The pose's own host time is that of its tick by the alignment of both clocks.
        """
        if packet.timer is None or len(packet.counts) != JOINTS:
            raise UserError(f"a pose needs a timer and six counts, got {packet}")
        flags = PoseFlag.NONE
        ticks = self._ticks_at(packet.timer, host_time_s)
        self._reading[:] = packet.counts
        counts = self._reading.copy()
        if self._goes_on:
            plausible = self._continue(
                self._reading,
                self._counts,
                FIELD,
                self._windows,
                self._fastest,
                ticks - self._ticks,
                ALLOWED_COUNTS,
                counts,
            )
            misread = self._too_early(ticks, host_time_s)
            if misread or not plausible:
                if self._refusals < LARGEST_REFUSALS:
                    self._refusals += 1
                    self.refused += 1
                    return None
                self.jumps += 1
                flags = PoseFlag.JUMP
                if misread:
                    ticks = self._ticks_by_host(host_time_s)
                    self.alignment.forget()
        self._refusals = 0
        self._timer, self._ticks, self._counts = packet.timer, ticks, counts
        self._goes_on = True
        self._host_time_s = host_time_s
        time_s = ticks / TICKS_PER_S
        self.watch.observe(counts.tolist(), time_s)
        return Pose.of_rigid(
            time_s,
            self.alignment.observe(ticks, host_time_s),
            self._forward.device_from_tip(counts),
            packet.buttons & self._pedals,
            flags,
        )

    def forget(self) -> None:
        """Begin anew with the next sample, whose counts and timer continue nothing.

        Time goes on nevertheless.
        """
        self._goes_on = False
        self._refusals = 0
        self.alignment.forget()

    def lost_power(self, packet: Packet, host_time_s: float) -> bool:
        """Return whether the timer began anew since the last accepted sample."""
        if self._timer is None or packet.timer is None:
            return False
        elapsed = (host_time_s - self._host_time_s) * TICKS_PER_S
        ahead = (packet.timer - self._timer - elapsed) % self.timer_turn
        return min(ahead, self.timer_turn - ahead) > POWER_CUT_S * TICKS_PER_S

    def _ticks_at(self, timer: int, host_time_s: float) -> int:
        """Continue the ticks; whole wraps come from the host's clock.

        The timer alone is ambiguous after 18.2 s of silence. As many turns as the
        host's clock leaves room for: a packet may be late, not early.
        """
        if self._timer is None:
            return timer
        if not self._goes_on:
            return self._ticks_by_host(host_time_s)
        part = (timer - self._timer) % self.timer_turn
        elapsed = (host_time_s - self._host_time_s + POWER_CUT_S) * TICKS_PER_S
        wraps = max(0, int((elapsed - part) // self.timer_turn))
        return self._ticks + part + wraps * self.timer_turn

    def _ticks_by_host(self, host_time_s: float) -> int:
        elapsed = round((host_time_s - self._host_time_s) * TICKS_PER_S)
        return self._ticks + max(elapsed, 1)

    def _too_early(self, ticks: int, host_time_s: float) -> bool:
        slack = EARLIEST_S if self.alignment.settled else POWER_CUT_S
        return self.alignment.earliness(ticks, host_time_s) > slack
