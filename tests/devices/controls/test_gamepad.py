"""Sticks and caps as controls of the scope."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

import devices.controls.gamepad
from devices.controls.gamepad import (
    DEAD_SHARE,
    MOUSE,
    MOUSE_AXES,
    PAD,
    PAD_AXES,
    RELATIVE_S,
    Gamepad,
    GamepadLayout,
    deflection,
    layout_of,
    open_gamepad,
)
from devices.controls.linux_input import (
    EV_ABS,
    EV_KEY,
    EV_REL,
    AxisRange,
    InputDescription,
    InputEvent,
)
from devices.controls.steering import Axis, Steering
from devices.microscribe.emulator.in_memory import DrivenClock
from devices.port import DeviceError, DeviceReason

STICK = AxisRange(-32768, 32767, 128)
CAP = AxisRange(-350, 350)
SIX = range(6)

PAD_TOLD = InputDescription(
    "pad", dict.fromkeys(range(6), STICK), frozenset(), frozenset({0x130, 0x131, 0x133})
)
CAP_TOLD = InputDescription(
    "cap", dict.fromkeys(SIX, CAP), frozenset(), frozenset({0x100, 0x101})
)
OLD_CAP_TOLD = InputDescription("old cap", {}, frozenset(SIX), frozenset({0x100}))


@dataclass
class Device:
    description: InputDescription
    waiting: list[InputEvent] = field(default_factory=list)
    closed: int = 0

    def read(self) -> Sequence[InputEvent]:
        events, self.waiting = self.waiting, []
        return events

    def close(self) -> None:
        self.closed += 1


ranges = st.tuples(st.integers(-40000, 0), st.integers(1, 40000)).map(
    lambda ends: AxisRange(*ends)
)


@given(ranges, st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_deflection_is_odd_rising_dead_in_the_middle_and_full_at_the_ends(
    extent: AxisRange, one: float, other: float
) -> None:
    middle, half = (extent.high + extent.low) / 2, (extent.high - extent.low) / 2

    def at(share: float) -> float:
        return deflection(round(middle + share * half), extent)

    low, high = sorted((one, other))
    assert -1.0 <= at(-high) <= at(-low) <= at(low) <= at(high) <= 1.0
    assert deflection(extent.high, extent) == 1.0
    assert deflection(extent.low, extent) == -1.0
    # A whole number may lie half a step off the share that was asked for.
    if low * half + 0.5 < DEAD_SHARE * half:
        assert at(low) == at(-low) == 0.0


def test_values_beyond_the_range_and_empty_ranges_are_harmless() -> None:
    assert deflection(10**6, CAP) == 1.0
    assert deflection(-(10**6), CAP) == -1.0
    assert deflection(5, AxisRange(0, 0)) == 0.0
    assert deflection(20, AxisRange(-100, 100, flat=30)) == 0.0


@pytest.mark.parametrize(
    ("told", "layout"), [(PAD_TOLD, PAD), (CAP_TOLD, MOUSE), (OLD_CAP_TOLD, MOUSE)]
)
def test_pads_and_caps_are_told_apart(
    told: InputDescription, layout: GamepadLayout
) -> None:
    assert layout_of(told) is layout
    assert Gamepad(Device(told)).layout is layout


BYTE = AxisRange(0, 255, 15, 128)
TRIGGER = AxisRange(0, 255, 15, 0)
WITHOUT_DRIVER = {0: BYTE, 1: BYTE, 2: BYTE, 5: BYTE, 16: AxisRange(-1, 1)}
NUMBERED, NAMED = frozenset(range(0x120, 0x12C)), frozenset(range(0x130, 0x13E))


@pytest.mark.parametrize("keys", [NUMBERED, NAMED])
@pytest.mark.parametrize("triggers", [{}, {3: TRIGGER, 4: TRIGGER}])
def test_a_pad_without_a_driver_steers_with_both_sticks(
    keys: frozenset[int], triggers: dict[int, AxisRange]
) -> None:
    told = InputDescription("plain pad", WITHOUT_DRIVER | triggers, frozenset(), keys)
    first = min(keys)
    for code, axis, sign in (
        (0, Axis.YAW, 1),
        (1, Axis.PITCH, -1),
        (2, Axis.ROLL, 1),
        (5, Axis.INSERT, -1),
    ):
        steering, device = Steering(), Device(told)
        device.waiting = [
            InputEvent(0.5, EV_ABS, code, 255),
            InputEvent(0.5, EV_ABS, 3, 0),
            InputEvent(0.5, EV_KEY, first + 1, 1),
        ]
        Gamepad(device, DrivenClock()).poll(steering)
        demand, buttons = steering.step(0.0, 1.0)
        assert demand[axis] == pytest.approx(sign * 0.5)
        assert sum(map(abs, demand)) == abs(demand[axis])
        assert buttons == 2


def test_a_driver_that_has_triggers_on_the_other_axes_keeps_its_stick() -> None:
    axes = {0: STICK, 1: STICK, 2: TRIGGER, 3: STICK, 4: STICK, 5: TRIGGER}
    told = InputDescription("pad", axes, frozenset(), NAMED)
    assert layout_of(told) is PAD


@pytest.mark.parametrize(
    "told",
    [
        InputDescription("stick", {**WITHOUT_DRIVER, 6: BYTE}, frozenset(), NUMBERED),
        InputDescription("keyboard", {}, frozenset(), frozenset(range(1, 200))),
        InputDescription("mouse", {}, frozenset({0, 1, 8}), frozenset({0x110})),
        InputDescription("tablet", {0: CAP, 1: CAP}, frozenset(), frozenset({0x14A})),
    ],
)
def test_other_devices_are_refused(told: InputDescription) -> None:
    assert layout_of(told) is None
    with pytest.raises(DeviceError, match=told.name) as caught:
        Gamepad(Device(told))
    assert caught.value.reason is DeviceReason.WRONG_DEVICE


@pytest.mark.parametrize(
    ("told", "axes", "full"), [(PAD_TOLD, PAD_AXES, 32767), (CAP_TOLD, MOUSE_AXES, 350)]
)
def test_every_axis_moves_its_freedom_from_the_moment_it_says(
    told: InputDescription, axes: dict[int, tuple[Axis, int]], full: int
) -> None:
    assert sorted(axis for axis, _ in axes.values()) == list(Axis)
    for code, (axis, sign) in axes.items():
        steering, device = Steering(), Device(told)
        device.waiting = [InputEvent(0.75, EV_ABS, code, full)]
        Gamepad(device, DrivenClock()).poll(steering)
        demand, _ = steering.step(0.0, 1.0)
        assert demand[axis] == pytest.approx(sign * 0.25)
        assert sum(map(abs, demand)) == abs(demand[axis])


def test_buttons_are_pedals_and_other_controls_do_nothing() -> None:
    steering, device = Steering(), Device(PAD_TOLD)
    pad = Gamepad(device, DrivenClock())
    device.waiting = [
        InputEvent(0.1, EV_KEY, 0x131, 1),
        InputEvent(0.2, EV_KEY, 0x133, 1),
        InputEvent(0.2, EV_ABS, 2, 32767),
        InputEvent(0.2, EV_REL, 8, 1),
    ]
    pad.poll(steering)
    demand, buttons = steering.step(0.0, 1.0)
    assert buttons == 2
    assert not any(demand)
    device.waiting = [InputEvent(1.1, EV_KEY, 0x131, 0)]
    pad.poll(steering)
    steering.step(1.0, 2.0)
    assert steering.step(2.0, 3.0)[1] == 0
    pad.close()
    assert device.closed == 1


def test_a_cap_that_falls_silent_counts_as_let_go() -> None:
    steering, device, clock = Steering(), Device(OLD_CAP_TOLD), DrivenClock()
    pad = Gamepad(device, clock)
    device.waiting = [InputEvent(1.0, EV_REL, 5, 350)]
    clock.sleep_until(1.05)
    pad.poll(steering)
    clock.sleep_until(2.0)
    pad.poll(steering)
    pad.poll(steering)
    demand, _ = steering.step(0.0, 2.0)
    assert demand.yaw * 2.0 == pytest.approx(RELATIVE_S)
    assert not any(steering.step(2.0, 3.0)[0])


def test_a_machine_without_a_pad_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(devices.controls.gamepad, "input_devices", list)
    with pytest.raises(DeviceError, match="no gamepad") as caught:
        open_gamepad()
    assert caught.value.reason is DeviceReason.NO_DEVICE
    # One that may not be opened is worth more words than "none".
    monkeypatch.setattr(
        devices.controls.gamepad, "input_devices", lambda: [tmp_path / "event3"]
    )
    with pytest.raises(DeviceError, match="event3"):
        open_gamepad()
    with pytest.raises(DeviceError, match="event4"):
        open_gamepad(tmp_path / "event4")
