"""One input of a flight: how it is opened and how its poses become samples."""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping
from contextlib import AbstractContextManager
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from devices import Registration
from devices.controls.keyboard import MouseKeys
from devices.controls.roll import EncoderRoll
from devices.controls.rumble import Rumble
from paravol.inputs.pose_completer import HandChannel, PoseCompleter
from paravol.inputs.pose_sources import OrderedPoses
from paravol.inputs.turns import DeviceTurns
from paravol.patient import PatientScene
from renderers.scene import Change
from surgery.patient import OperatedPatient

POST_IS_Y_DEG = -90.0
"""Roll is counted from x of a tip frame; with the light post along y it is this."""


class FlightInput(ABC):
    """What an input needs and gives, before it is opened.

    name: for the window. keys: its own buttons, to be shown; those of the keyboard are
    the window's. completer: makes samples of its poses. until_s: when the flight is
    over. registration: where its frame lies in the patient; None when fiducials must be
    touched, ``touch_hint`` says how.
    controls: takes keys and mouse, where those steer. turns: gives its device to the
    tool and back, once it is open; None where that cannot be. is_held_by_walls: whether
    walls hold a hand that feels nothing. rumble: of the pad that steers, None where it
    has none. can_lay: whether it brings the scope to a place by itself. may_skip:
    whether poses may be left out on a machine that is too slow, as nothing was measured
    that would be lost.
    """

    name: str
    completer: PoseCompleter
    keys: Mapping[str, str] = MappingProxyType({})
    has_instrument: bool = False
    until_s: float = math.inf
    registration: Registration | None = None
    touch_hint: str = ""
    controls: MouseKeys | None = None
    is_held_by_walls: bool = True
    may_skip: bool = False
    can_lay: bool = False
    rumble: Rumble | None = None
    turns: DeviceTurns | None = None

    @abstractmethod
    def open(self, patient: PatientScene) -> AbstractContextManager[OrderedPoses]:
        """Open it for this patient; DeviceError or UserError when that cannot be."""

    def placed(self, registration: Registration) -> None:
        """Hear where the poses lie in the patient, before any becomes a sample."""
        # Most inputs have no use for it.
        del registration

    def operated(self, patient: OperatedPatient) -> None:
        """Hear whose tissue is cut, before the input is opened."""
        del patient

    def changed(self, changes: Iterable[Change]) -> None:
        """Hear what was cut, by the thread that flies."""
        del changes

    @property
    def is_wedged(self) -> bool:
        """Return whether walls hold what is steered, whatever is asked for."""
        return False

    @property
    def is_laid(self) -> bool:
        """Return whether the scope is on its way to where it was told to lie."""
        return False

    def go_out(self) -> None:
        """Take what is steered back outside; a hand that holds a device does that."""
        del self

    def lay(
        self,
        frame: NDArray[np.float64],
        entry_mm: NDArray[np.float64],
        drawn_mm: float,
    ) -> None:
        """Bring the scope to a frame, where `can_lay`; see `FulcrumControl.lay`."""
        del frame, entry_mm, drawn_mm

    def last_lines(self) -> list[str]:
        """Return what there is to tell after the flight, for a terminal."""
        return []

    def on_swap(self, heard: Callable[[], object]) -> None:
        """Call `heard` when a button of the device asks for the tool, or the scope."""
        # Most devices have no button for it.
        del heard


def in_the_patient() -> Registration:
    """Return the registration of poses that are in the patient's frame already."""
    return Registration(np.eye(4), 0.0, np.zeros(0))


def framed_hand(world_from_device: NDArray[np.float64] | None = None) -> HandChannel:
    """Take the roll from the tip frame, whose y axis points to the light post.

    world_from_device: where the poses' frame lies, 4x4; None for the patient's own.
    """
    place = np.eye(4) if world_from_device is None else world_from_device
    return HandChannel(EncoderRoll(place, POST_IS_Y_DEG))
