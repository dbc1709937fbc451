"""Packets of one arm -> poses, without input or output.

Keeps what one packet does not know: how often counts and timer have wrapped, how fast
the arm was, when it was last believed.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

from devices.microscribe.alignment import TICKS_PER_S, ClockAlignment
from devices.microscribe.arm import FIELD, JOINTS, ArmGeometry, Encoders
from devices.microscribe.encoder_watch import EncoderWatch
from devices.microscribe.forward import ForwardKinematics
from devices.microscribe.packets import Packet
from devices.pose import Pose, PoseFlag

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

_HALF_FIELD = FIELD // 2


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
    _counts: tuple[int, ...] = (0,) * JOINTS
    _refusals: int = 0
    _forward: ForwardKinematics = field(init=False)
    _limits: list[tuple[int, float]] = field(init=False)
    """Per joint: counts modulo which steps are told apart, and counts per tick."""
    _pedals: int = field(init=False)

    def __post_init__(self) -> None:
        turns = self.encoders.turn
        self.watch = EncoderWatch([turn > 1 for turn in turns])
        self._forward = ForwardKinematics(self.geometry, self.encoders)
        self._pedals = ~_INDEX_PULSE if turns[5] > 1 else ~0
        per_tick = LARGEST_RATE_DEG_S / 360.0 / TICKS_PER_S
        # Where whole turns fit into the field, the winding bits change no angle.
        # What a joint without encoder sends is nobody's motion.
        self._limits = [
            (turn if FIELD % turn == 0 else FIELD, turn * per_tick)
            if turn > 1
            else (FIELD, float("inf"))
            for turn in turns
        ]

    @property
    def counts(self) -> tuple[int, ...]:
        """Get the unwrapped counts of the last accepted sample."""
        return self._counts

    def accept(self, packet: Packet, host_time_s: float) -> Pose | None:
        """Return the pose of a packet with timer and six counts, or None if refused.

        ``host_time_s`` is the arrival of its header on the host's monotonic clock.
        The pose's own host time is that of its tick by the alignment of both clocks.
        """
        if packet.timer is None or len(packet.counts) != JOINTS:
            raise ValueError(f"a pose needs a timer and six counts, got {packet}")
        flags = PoseFlag.NONE
        ticks, counts = self._ticks_at(packet.timer, host_time_s), packet.counts
        if self._goes_on:
            counts, plausible = self._continued(counts, ticks - self._ticks)
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
        self.watch.observe(counts, time_s)
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

    def _continued(
        self, reading: Sequence[int], ticks: int
    ) -> tuple[tuple[int, ...], bool]:
        """Continue counts over the wraps of their field; say whether a hand can do it.

        Right as long as no joint turns by half its field between two samples.
        """
        counts = []
        plausible = True
        for new, old, (window, per_tick) in zip(
            reading, self._counts, self._limits, strict=True
        ):
            step = (new - old + _HALF_FIELD) % FIELD - _HALF_FIELD
            counts.append(old + step)
            if window != FIELD:
                half = window // 2
                step = (step + half) % window - half
            if abs(step) > per_tick * ticks + ALLOWED_COUNTS:
                plausible = False
        return tuple(counts), plausible
