"""Keys and mouse, as names and numbers."""

from hypothesis import given
from hypothesis import strategies as st

from devices.controls.fulcrum import Demand
from devices.controls.keyboard import (
    FINE,
    FINE_SHARE,
    INSERT_MM_PER_NOTCH,
    MOVES,
    PEDALS,
    Feel,
    MouseKeys,
)
from devices.controls.steering import Axis, Steering

ALL_KEYS = [*MOVES, *PEDALS, FINE]
strokes = st.lists(st.tuples(st.sampled_from(ALL_KEYS), st.booleans()), max_size=60)


def require_after(steering: Steering, at_s: float) -> tuple[Demand, int]:
    steering.step(at_s - 1.0, at_s)
    return steering.step(at_s, at_s + 1.0)


@given(strokes)
def test_what_is_asked_depends_only_on_the_keys_that_are_down(
    strokes: list[tuple[str, bool]],
) -> None:
    steering = Steering()
    keys = MouseKeys(steering)
    down: set[str] = set()
    for number, (name, is_down) in enumerate(strokes):
        assert keys.key(name, is_down, number * 0.01)
        (down.add if is_down else down.discard)(name)
    demand, buttons = require_after(steering, 10.0)
    for axis in Axis:
        share = FINE_SHARE if FINE in down else 1.0
        asked = sum(s for k, (f, s) in MOVES.items() if f == axis and k in down)
        assert demand[axis] == asked * share
    assert buttons == sum(bit for key, bit in PEDALS.items() if key in down)


@given(strokes)
def test_letting_go_stops_everything(strokes: list[tuple[str, bool]]) -> None:
    steering = Steering()
    keys = MouseKeys(steering)
    for name, is_down in strokes:
        keys.key(name, is_down, 0.0)
    keys.release(1.0)
    assert require_after(steering, 10.0) == (Demand(), 0)


def test_every_freedom_can_be_moved_both_ways() -> None:
    for axis in Axis:
        assert sorted(s for f, s in MOVES.values() if f == axis) == [-1, 1]


def test_repeats_of_a_held_key_change_nothing_and_strange_keys_are_left() -> None:
    steering = Steering()
    keys = MouseKeys(steering)
    for at in range(5):
        assert keys.key("move in", True, float(at))
    assert keys.key("move in", False, 5.0)
    demand, _ = steering.step(0.0, 10.0)
    assert demand.insert == 0.5
    assert not keys.key("end", True, 6.0)
    assert not keys.key("W", True, 6.0)


def test_the_mouse_tilts_turns_and_inserts() -> None:
    steering = Steering()
    keys = MouseKeys(steering)
    keys.drag(10.0, 0.0, False, 0.1)
    keys.drag(0.0, -10.0, False, 0.2)
    keys.drag(10.0, 99.0, True, 0.3)
    keys.wheel(2.0, 0.4)
    demand, _ = steering.step(0.0, 1.0)
    assert demand.yaw_nudge_deg == demand.pitch_nudge_deg > 0.0
    assert demand.roll_nudge_deg > 0.0
    assert demand.insert_nudge_mm == 2.0 * INSERT_MM_PER_NOTCH
    assert demand[:4] == (0.0, 0.0, 0.0, 0.0)


def test_sensitivity_and_inversion_are_factors() -> None:
    asked = []
    for feel in (Feel(), Feel(drag=2.0, pitch=-1.0, wheel=-0.5, keys=0.25)):
        steering = Steering()
        keys = MouseKeys(steering, feel)
        keys.drag(10.0, 10.0, False, 0.1)
        keys.drag(10.0, 0.0, True, 0.1)
        keys.wheel(1.0, 0.1)
        keys.key("move in", True, 0.0)
        asked.append(steering.step(0.0, 1.0)[0])
    plain, felt = asked
    assert felt.insert == 0.25 * plain.insert
    assert felt.yaw_nudge_deg == 2.0 * plain.yaw_nudge_deg
    assert felt.pitch_nudge_deg == -2.0 * plain.pitch_nudge_deg
    assert felt.roll_nudge_deg == 2.0 * plain.roll_nudge_deg
    assert felt.insert_nudge_mm == -0.5 * plain.insert_nudge_mm
