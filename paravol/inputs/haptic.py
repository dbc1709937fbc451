"""A force device as input: what steers is felt, and what is flown is the device's pose.

The emulated device is held by whatever else steers: mouse, recording, arm. That says
where the hand is; the pose that is flown and recorded is the one that the device's
encoders count, so that a recording replays as any other.
"""

import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace

from devices import DeviceError, DeviceReason, Pose, Registration
from devices.haptics.force_port import ForceDevice
from devices.haptics.mock_head import HeadFault, MockHead
from paravol.haptics.force_loop import (
    PERIOD_S,
    DeviceState,
    ForceLoop,
    new_feeling,
    scope_balls,
)
from paravol.haptics.tissue_copies import TissueCopies
from paravol.inputs.flight_input import FlightInput
from paravol.inputs.pose_completer import PoseCompleter
from paravol.inputs.pose_sources import OrderedPoses
from paravol.patient import PatientScene
from renderers.scene import Change
from scenarios import Sample, Scenario
from surgery.patient import OperatedPatient
from system import UserError

FORMS = "none, emulated or force-dimension"

SHORTEST_S, LONGEST_S = 0.001, 0.05
"""A hand takes so long from one of its poses to the next, at least and at most."""

RATE_HZ = 100.0
"""Poses a second that are flown of a device that steers by itself."""


def felt_input(
    words: str, fault: str | None, steering: FlightInput, scenario: Scenario
) -> FlightInput:
    """Let a flight's input be felt, as the words of `--haptics` say.

    fault: of the emulated device, the words of `--haptics-fault`. UserError for words
    that name nothing.
    """
    if fault is not None and words != "emulated":
        raise UserError(
            "--haptics-fault makes the emulated force device misbehave; add "
            "--haptics emulated."
        )
    radius_mm = scenario.scope.endoscope().diameter_mm / 2
    match words:
        case "none":
            return steering
        case "emulated":
            suffers = HeadFault() if fault is None else HeadFault.parse(fault)
            return EmulatedHapticInput(steering, suffers, radius_mm)
        case "force-dimension":
            from devices.haptics.force_dimension import ForceDimension

            return ForceDeviceInput(ForceDimension.open(), radius_mm)
    raise UserError(f"--haptics must be {FORMS}; got {words!r}.")


@dataclass(slots=True)
class FeltCompleter:
    """Complete poses as another does, and keep the pose itself."""

    inner: PoseCompleter

    def complete(self, pose: Pose) -> Sample:
        """Join a pose with the other's channel; a recording has poses of its own."""
        sample = self.inner.complete(pose)
        return replace(sample, device_from_tip=pose.device_from_tip)


class _HapticInput(FlightInput):
    """Run the force loop while the input is open."""

    def __init__(self, radius_mm: float) -> None:
        self._radius_mm = radius_mm
        self._operated: OperatedPatient | None = None
        self._copies: TissueCopies | None = None
        self._loop: ForceLoop | None = None
        self._lines: list[str] = []

    def operated(self, patient: OperatedPatient) -> None:
        """Hear whose tissue is felt, before it is opened."""
        self._operated = patient

    def changed(self, changes: Iterable[Change]) -> None:
        """Let what was cut be felt."""
        if self._copies is not None:
            self._copies.follow(changes)

    def placed(self, registration: Registration) -> None:
        """Begin with forces."""
        assert self._loop is not None
        self._loop.place(registration.world_from_device)

    def last_lines(self) -> list[str]:
        """Return how the loop ran."""
        return self._lines

    @contextmanager
    def _felt(self, device: ForceDevice) -> Iterator[ForceLoop]:
        """Run the loop for a device, which it closes."""
        patient = self._operated
        assert patient is not None
        self._copies = copies = TissueCopies(patient)
        balls = scope_balls(self._radius_mm)
        feeling = new_feeling(patient.layers, balls, device.limits, PERIOD_S)
        with ForceLoop(device, copies.tissue, feeling) as loop:
            self._loop = loop
            try:
                yield loop
            finally:
                self._lines = loop.figures().lines()
                self._loop = self._copies = None


class EmulatedHapticInput(_HapticInput):
    """Let the emulated device be held by another input.

    Nothing holds the other one before a wall: the force does.
    """

    def __init__(
        self, steering: FlightInput, fault: HeadFault, radius_mm: float
    ) -> None:
        super().__init__(radius_mm)
        self._fault = fault
        self._steering = steering
        steering.is_held_by_walls = False
        self.name = f"{steering.name}, felt by an emulated device"
        self.keys = steering.keys
        self.completer = FeltCompleter(steering.completer)
        self.has_instrument = steering.has_instrument
        self.until_s = steering.until_s
        self.touch_hint = steering.touch_hint
        self.controls = steering.controls
        self.registration = steering.registration

    @contextmanager
    def open(self, patient: PatientScene) -> Iterator[OrderedPoses]:
        """Open what steers, then put the device into its hand."""
        head = MockHead(fault=self._fault)
        with self._steering.open(patient) as hand, self._felt(head) as loop:
            # an arm's is known only when it is open
            self.registration = self._steering.registration
            self._poses = FeltPoses(hand, head, loop)
            yield self._poses

    def placed(self, registration: Registration) -> None:
        """Begin with forces, and to fly what the device measures."""
        self._steering.placed(registration)
        self._poses.is_flown = True
        super().placed(registration)


@dataclass(slots=True)
class FeltPoses:
    """Lead the emulated device by a hand's poses and return the device's.

    is_flown: before the registration is known the hand's own poses are returned: the
    hand's device is what is registered.
    """

    hand: OrderedPoses
    head: MockHead
    loop: ForceLoop
    is_flown: bool = False
    _last_s: float | None = None
    _is_away: bool = False

    def read(self, timeout_s: float) -> Pose:
        """Return the next pose; raise as the hand's source does.

        DeviceError(DISCONNECTED) once when the device goes away; while it is away or
        measures nothing, TimeoutError.
        """
        until = time.monotonic() + timeout_s
        while True:
            pose = self.hand.read(max(until - time.monotonic(), 0.0))
            last_s = pose.time_s if self._last_s is None else self._last_s
            lasts_s = min(max(pose.time_s - last_s, SHORTEST_S), LONGEST_S)
            self._last_s = pose.time_s
            self.head.lead(pose.device_from_tip, lasts_s, pose.buttons)
            if not self.is_flown:
                return pose
            state = self.loop.state
            if state.is_away and not self._is_away:
                self._is_away = True
                raise _away(self.head.name)
            if state.is_measured:
                self._is_away = False
                return replace(pose, device_from_tip=state.device_from_tip)
            if time.monotonic() >= until:
                raise TimeoutError(
                    f"no pose came from the {self.head.name} in {timeout_s:g} s"
                )


class ForceDeviceInput(_HapticInput):
    """Fly with a force device that somebody holds; fiducials are touched with it."""

    def __init__(self, device: ForceDevice, radius_mm: float) -> None:
        from paravol.inputs.pose_completer import HandChannel

        super().__init__(radius_mm)
        self._device = device
        self.name = device.name
        self.completer = HandChannel()
        self.touch_hint = "Hold the tip on it and press the device's first button."

    @contextmanager
    def open(self, patient: PatientScene) -> Iterator[OrderedPoses]:
        """Begin to read it; it pushes once it is registered."""
        with self._felt(self._device) as loop:
            yield DevicePoses(self.name, loop)


class DevicePoses:
    """Read a device that steers by itself, at an even rate."""

    def __init__(self, name: str, loop: ForceLoop) -> None:
        self._name = name
        self._loop = loop
        self._began_s = time.monotonic()
        self._number = 0
        self._is_away = False

    def read(self, timeout_s: float) -> Pose:
        """Return the next pose; DeviceError(DISCONNECTED) once when it goes away."""
        until = time.monotonic() + timeout_s
        while True:
            due = self._began_s + self._number / RATE_HZ
            now = time.monotonic()
            if min(due, until) > now:
                time.sleep(min(due, until) - now)
            if due > until:
                raise TimeoutError(f"no pose came from {self._name} in {timeout_s:g} s")
            # a reader that was away gets no poses of moments that are past
            behind = int((time.monotonic() - due) * RATE_HZ)
            self._number += 1 + max(behind, 0)
            state = self._loop.state
            if state.is_away and not self._is_away:
                self._is_away = True
                raise _away(self._name)
            if state.is_measured:
                self._is_away = False
                return _pose_of(state, due - self._began_s, due)


def _pose_of(state: DeviceState, time_s: float, host_time_s: float) -> Pose:
    return Pose(time_s, host_time_s, state.device_from_tip, state.buttons)


def _away(name: str) -> DeviceError:
    return DeviceError(
        DeviceReason.DISCONNECTED,
        f"The {name} went away; plug it in again: its force grows slowly then.",
    )
