"""One input of a flight: how it is opened and how its poses become samples."""

import math
from abc import ABC, abstractmethod
from contextlib import AbstractContextManager
from dataclasses import dataclass, field, replace

import numpy as np

from app.flight import Aim, OrderedPoses
from app.operating_room import OperatingRoom
from app.second_channel import HandChannel
from devices import Pose, Registration
from devices.controls import MouseKeys
from devices.roll import EncoderRoll
from scenarios import Sample

POST_IS_Y_DEG = -90.0
"""Roll is counted from x of a tip frame; with the light post along y it is this."""


class FlightInput(ABC):
    """Say what an input needs and gives, before it is opened.

    name: for the window. keys: its controls, to be shown. aim: completes its poses.
    until_s: when the flight is over. registration: where its frame lies in the
    patient; None when fiducials must be touched, ``touch_hint`` says how.
    controls: takes keys and mouse, where those steer.
    """

    name: str
    aim: Aim
    keys: dict[str, str]
    has_instrument: bool = False
    until_s: float = math.inf
    registration: Registration | None = None
    touch_hint: str = ""
    controls: MouseKeys | None = None

    @abstractmethod
    def open(self, room: OperatingRoom) -> AbstractContextManager[OrderedPoses]:
        """Open it in this room; DeviceError or ValueError when that cannot be done."""


def in_the_patient() -> Registration:
    """Give the registration of poses that are in the patient's frame already."""
    return Registration(np.eye(4), 0.0, np.zeros(0))


@dataclass(slots=True)
class FramedHand:
    """Take the roll from the tip frame, whose y axis points to the light post."""

    _hand: HandChannel = field(default_factory=HandChannel)
    _roll: EncoderRoll = field(
        default_factory=lambda: EncoderRoll(np.eye(4), POST_IS_Y_DEG)
    )

    def complete(self, pose: Pose) -> Sample:
        """Join a pose with its own roll; no second tool."""
        roll_deg = self._roll.roll_deg(pose) or 0.0
        return replace(self._hand.complete(pose), roll_deg=roll_deg)
