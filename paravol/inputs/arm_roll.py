"""Who knows the roll of a scope that an arm holds: the words of `--roll`."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from devices import DeviceError, Pose
from devices.controls.roll import EncoderRoll, HorizonRoll, RollSource, SecondDeviceRoll
from devices.microscribe.wire.link import ArmDescription
from devices.port import DeviceReason
from devices.source import QueuedSource
from paravol.inputs.flight_input import POST_IS_Y_DEG
from paravol.inputs.igtl import peer_address
from system import UserError

FORMS = "horizon, encoder or igtl:HOST:PORT[:TOOL]"


@dataclass(slots=True)
class ClampedRoll:
    """Follow a sixth encoder from how the scope was clamped: its first pose is level.

    The roll is unknown until `place` is called.
    """

    _encoder: EncoderRoll | None = None
    _is_level: bool = False

    def place(self, world_from_device: NDArray[np.float64]) -> None:
        """Take where the arm stands, 4x4; the next pose is level."""
        self._encoder = EncoderRoll(world_from_device)
        self._is_level = False

    def roll_deg(self, pose: Pose) -> float | None:
        """Return the turn since the first pose, on top of the horizon."""
        if self._encoder is None:
            return None
        if not self._is_level:
            self._encoder.level(pose)
            self._is_level = True
        return self._encoder.roll_deg(pose)


@dataclass(slots=True)
class FollowedRoll:
    """Take the roll of a second device's tool, whose y axis points to the light post.

    readings: its poses in the patient, on the same clock as those of the arm.
    """

    readings: QueuedSource
    _frame: EncoderRoll = field(
        default_factory=lambda: EncoderRoll(np.eye(4), POST_IS_Y_DEG)
    )
    _rolls: SecondDeviceRoll = field(default_factory=SecondDeviceRoll)
    _newest_s: float = -np.inf

    def roll_deg(self, pose: Pose) -> float | None:
        """Return the roll when the pose was measured, None without a fresh reading."""
        for reading in self._news():
            roll_deg = self._frame.roll_deg(reading)
            if roll_deg is not None and reading.host_time_s > self._newest_s:
                self._rolls.put(reading.host_time_s, roll_deg)
                self._newest_s = reading.host_time_s
        return self._rolls.roll_deg(pose)

    def _news(self) -> list[Pose]:
        try:
            return self.readings.drain()
        except DeviceError as error:
            # Readings pile up while the arm is registered; only new ones count.
            if error.reason is not DeviceReason.OVERRUN:
                raise
            return self.readings.drain()


def check_roll(words: str) -> None:
    """Raise UserError, in one sentence, for words that name no source of roll."""
    kind, _, rest = words.partition(":")
    if kind == "igtl":
        peer_address("--roll", rest)
    elif words not in {"horizon", "encoder"}:
        raise UserError(f"--roll must be {FORMS}; got {words!r}.")


@contextmanager
def opened_roll(words: str, arm: ArmDescription) -> Iterator[RollSource]:
    """Open what the words name, as `check_roll` lets them pass, for this arm.

    Raises DeviceError when the arm has no sixth encoder or the peer is not there.
    """
    kind, _, rest = words.partition(":")
    if kind == "igtl":
        from devices.openigtlink import OpenIGTLinkSource

        with OpenIGTLinkSource(*peer_address("--roll", rest)) as peer:
            yield FollowedRoll(peer)
    elif kind == "encoder":
        if arm.maxima.encoders[-1] == 0:
            raise DeviceError(
                DeviceReason.WRONG_DEVICE,
                f"the arm {arm.identity.serial!r} has no sixth encoder to measure the "
                "roll with; fly with --roll horizon and the arrow keys.",
            )
        yield ClampedRoll()
    else:
        yield HorizonRoll()
