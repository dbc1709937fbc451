"""A second device as input: what moves the tool while another one moves the scope."""

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from devices import Pose, ProbePath
from devices.controls.gamepad import open_gamepad
from devices.controls.keyboard import MouseKeys
from devices.controls.steered_scope import ScopeController, SteeredArm
from devices.controls.steering import Steering
from devices.recording.player import RecordedArm
from devices.registration.pivot import shifted_to_tip
from devices.registration.registration_file import RegistrationRecord, load_registration
from paravol.inputs.hand import tool_control
from paravol.inputs.open_arm import arm_at
from paravol.inputs.recording import recorded_samples
from paravol.inputs.second_device import DrainedPoses, SecondDevice
from paravol.inputs.tool_hold import ToolHold
from paravol.patient import PatientScene
from paravol.registration.at_start import registered_by_file, tracker_record
from scenarios import InstrumentState, Sample, Scenario
from scenarios.instrument_state import NO_TOOL
from scenarios.sample import tool_frame
from scenarios.scenario import Start
from system import UserError

if TYPE_CHECKING:
    from devices.controls.fulcrum import FulcrumControl

WORK_BUTTON, SUCTION_BUTTON = 1, 2
"""What a device's right and left pedal do in the hand that holds the tool."""


class InstrumentInput(ABC):
    """What a second device is, before it is opened.

    name: for messages. keys: its own buttons, to be shown. controls: takes keys
    and mouse, where those steer. hold: walls that hold the tool, once it is open; None
    where it is where its device is. knows_roll: whether its poses tell the turn about
    the shaft. moves_shaft: whether they are those of the straight shaft, not of its
    tip.
    """

    name: str
    keys: Mapping[str, str] = MappingProxyType({})
    controls: MouseKeys | None = None
    hold: ToolHold | None = None
    knows_roll: bool = True
    moves_shaft: bool = False

    @abstractmethod
    def open(self, patient: PatientScene) -> "SecondDeviceContext":
        """Open it for this patient; DeviceError or UserError when that cannot be.

        Its poses are in the patient's frame.
        """

    def state(self, pose: Pose) -> InstrumentState | None:
        """Return what was recorded of the tool at a pose; None for a living hand."""
        del pose
        return None


if TYPE_CHECKING:
    from contextlib import AbstractContextManager

    SecondDeviceContext = AbstractContextManager[SecondDevice]


class _SteeredInstrument(InstrumentInput):
    """Steer the tool in the nostril, beside the scope or in the other one."""

    moves_shaft = True

    def __init__(self, path: ProbePath | None, start: Start, side: str | None) -> None:
        self._path, self._start = path, start
        self._side = side
        self._steering = Steering()

    @contextmanager
    def open(self, patient: PatientScene) -> Iterator[SecondDevice]:
        """Put the tool's tip into the nostril."""
        control, self.hold = tool_control(patient, self._path, self._start, self._side)
        sources = [self._source(control, self._handset())]

        def again() -> DrainedPoses:
            # from where it was: the control has not moved meanwhile
            sources.append(self._source(control, self._opened()))
            return sources[-1]

        try:
            yield SecondDevice(sources[0], self.name, again)
        finally:
            for source in sources:
                source.close()

    def _handset(self) -> ScopeController | None:
        """Return the device in the hand, None where events come by themselves."""
        return None

    def _opened(self) -> ScopeController | None:
        """Open it anew; DeviceError while it is not there."""
        return None

    def _source(
        self, control: "FulcrumControl", handset: ScopeController | None
    ) -> SteeredArm:
        return SteeredArm(control, self._steering, handset)


class MouseInstrument(_SteeredInstrument):
    """Steer the tool with keys and mouse."""

    def __init__(self, path: ProbePath | None, start: Start, side: str | None) -> None:
        super().__init__(path, start, side)
        self.name = "mouse and keyboard"
        self.controls = MouseKeys(self._steering)


class GamepadInstrument(_SteeredInstrument):
    """Steer the tool with a gamepad or 3D mouse, by its file or its number from 1."""

    def __init__(
        self,
        path: ProbePath | None,
        start: Start,
        side: str | None,
        file: Path | None,
        number: int,
    ) -> None:
        super().__init__(path, start, side)
        self._which = file, number
        self._pad = open_gamepad(file, number)
        self.name = self._pad.name
        shown = self._pad.layout.help
        # the last of them are the buttons: here they belong to the tool
        self.keys = shown | {[*shown][-1]: "work the tool; suction"}

    def _handset(self) -> ScopeController:
        return self._pad

    def _opened(self) -> ScopeController:
        return open_gamepad(*self._which)


class LinkInstrument(InstrumentInput):
    """Follow another program's tool: origin at its tip, +z back up its shaft."""

    def __init__(
        self,
        address: tuple[str, int, str | None],
        scenario: Scenario,
        registration_file: Path | None,
    ) -> None:
        host, port, tool = address
        self._peer = host, port
        self._record: RegistrationRecord | None = None
        if registration_file is not None:
            self._record = tracker_record(registration_file, tool, scenario)
            tool = self._record.arm_serial or None
        self._tool = tool
        self.name = f"OpenIGTLink {host}:{port}"

    @contextmanager
    def open(self, patient: PatientScene) -> Iterator[SecondDevice]:
        """Connect to the peer."""
        # Imported here: only this input needs the library.
        from devices.openigtlink import OpenIGTLinkSource

        with OpenIGTLinkSource(*self._peer, self._tool) as source:
            record = self._record
            if record is None:
                yield SecondDevice(source, self.name)
                return
            matrix = record.registration().world_from_device
            placed = PlacedPoses(source, matrix, np.array(record.tip_mm))
            yield SecondDevice(placed, self.name)


class ArmInstrument(InstrumentInput):
    """Follow a second arm, whose place a file of `paravol register` says."""

    knows_roll = False

    def __init__(self, device: str, scenario: Scenario, file: Path | None) -> None:
        if file is None:
            raise UserError(
                "--instrument arm needs --instrument-registration, a file of `paravol "
                "register` made since that arm was switched on."
            )
        load_registration(file)
        self._device = device
        self._scenario = scenario
        self._file = file
        self.name = f"arm {device}"
        self.keys = {"Right pedal": "the tool works", "Left pedal": "it sucks"}

    @contextmanager
    def open(self, patient: PatientScene) -> Iterator[SecondDevice]:
        """Open the port."""
        with arm_at(self._device) as arm:
            tipped, registration = registered_by_file(
                arm, self._file, arm.description, self._scenario
            )
            matrix = registration.world_from_device
            yield SecondDevice(PlacedPoses(arm, matrix, tipped.tip_mm), self.name)


class RecordedInstrument(InstrumentInput):
    """Play the tool of a recording: a session's folder, or a probe path's file."""

    def __init__(self, file: Path) -> None:
        """Read it; UserError when it holds no tool."""
        self.name = f"recording {file.name}"
        held = [s for s in recorded_samples(file) if s.instrument.name != NO_TOOL]
        if not held:
            raise UserError(f"{file} holds no tool beside the scope; choose another.")
        self._poses = [_tool_pose(sample) for sample in held]
        self._states = {sample.time_s: sample.instrument for sample in held}

    @contextmanager
    def open(self, patient: PatientScene) -> Iterator[SecondDevice]:
        """Begin to play."""
        with RecordedArm(self._poses, name=self.name) as source:
            yield SecondDevice(source, self.name)

    def state(self, pose: Pose) -> InstrumentState | None:
        """Return what the recorded tool was and did."""
        return self._states[pose.time_s]


@dataclass(frozen=True, slots=True)
class PlacedPoses:
    """Give a source's poses in the patient, at the tip that was calibrated.

    world_from_device: 4x4. tip_mm: ``(3,)`` in the frame of the tip that it states.
    """

    source: DrainedPoses
    world_from_device: NDArray[np.float64]
    tip_mm: NDArray[np.float64]

    def drain(self) -> list[Pose]:
        """Return every pose that is waiting; raise as the source does."""
        return [self._placed(pose) for pose in self.source.drain()]

    def _placed(self, pose: Pose) -> Pose:
        tipped = shifted_to_tip(pose, self.tip_mm)
        frame = self.world_from_device @ tipped.device_from_tip
        return Pose(pose.time_s, pose.host_time_s, frame, pose.buttons, pose.flags)


def _tool_pose(sample: Sample) -> Pose:
    return Pose(sample.time_s, 0.0, tool_frame(sample), 0)
