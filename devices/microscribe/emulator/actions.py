"""What a person does to an emulated arm, by name and moment.

``NAME@SECONDS`` or ``NAME@SECONDS+DURATION``, seconds since the first packet; 0 means
from power-on. Without a moment it happens at once.
"""

from collections.abc import Callable
from dataclasses import dataclass
from difflib import get_close_matches
from typing import NamedTuple

from devices.microscribe.emulator.emulated_arm import EmulatedArm
from devices.microscribe.emulator.faults.schedule import parse_schedule
from system import UserError

_Doing = Callable[[EmulatedArm, float], None]


class _ActionKind(NamedTuple):
    """What is done, how a person reads of it, and what ends it."""

    do: _Doing
    line: str
    undo: _Doing | None = None


def _pedal(bit: int, until_s: float) -> _Doing:
    return lambda arm, now_s: arm.hold_pedal(bit, until_s)


_Arm, _HELD, _FREE = EmulatedArm, float("inf"), float("-inf")
_LET_GO = [_pedal(bit, _FREE) for bit in (0, 1)]
_ACTION_KINDS = {
    "power_off": _ActionKind(_Arm.power_off, "cut the power", _Arm.power_on),
    "power_on": _ActionKind(_Arm.power_on, "give power again"),
    "power_cycle": _ActionKind(_Arm.power_cycle, "off and on at once"),
    "unplug": _ActionKind(_Arm.unplug, "pull the data plug", _Arm.replug),
    "replug": _ActionKind(_Arm.replug, "put it in again: a port with a new name"),
    "home_button": _ActionKind(_Arm.press_home_button, "press the Home button"),
    "right_pedal": _ActionKind(_pedal(0, _HELD), "press the right pedal", _LET_GO[0]),
    "left_pedal": _ActionKind(_pedal(1, _HELD), "press the left pedal", _LET_GO[1]),
    "release_right": _ActionKind(_LET_GO[0], "let the right pedal go"),
    "release_left": _ActionKind(_LET_GO[1], "let the left pedal go"),
}

ACTIONS = tuple(_ACTION_KINDS)


@dataclass(frozen=True, slots=True)
class Action:
    """One thing that is done to the arm at a moment."""

    name: str
    start_s: float = 0.0
    duration_s: float | None = None

    def start(self, arm: EmulatedArm, now_s: float) -> None:
        """Do it."""
        _ACTION_KINDS[self.name].do(arm, now_s)

    def end(self, arm: EmulatedArm, now_s: float) -> None:
        """Undo it."""
        undo = _ACTION_KINDS[self.name].undo
        if undo is not None:
            undo(arm, now_s)


def parse_action(text: str) -> Action:
    """Read ``NAME[@SECONDS[+DURATION]]``; raise ValueError that tells what is known."""
    name, at, moment = text.strip().partition("@")
    if name not in _ACTION_KINDS:
        near = get_close_matches(name, ACTIONS, 1, 0.3)
        hint = f"; the nearest is {near[0]!r}" if near else ""
        raise UserError(
            f"action must be one of {', '.join(ACTIONS)}, got {name!r}{hint}"
        )
    schedule = parse_schedule(moment if at else "0")
    if schedule.packet is not None or schedule.chance is not None:
        raise UserError(f"the moment of an action is in seconds, got {text!r}")
    if schedule.duration_s is not None and _ACTION_KINDS[name].undo is None:
        raise UserError(f"{name} has no duration, got {text!r}")
    return Action(name, schedule.start_s, schedule.duration_s)


def list_actions() -> dict[str, str]:
    """Return a line for every action."""
    return {name: kind.line for name, kind in _ACTION_KINDS.items()}


class ActionSchedule:
    """Actions that wait for their moment."""

    def __init__(self, actions: tuple[Action, ...]) -> None:
        begins = [(a.start_s, a.start) for a in actions]
        ends = [
            (a.start_s + a.duration_s, a.end)
            for a in actions
            if a.duration_s is not None
        ]
        self._waiting = sorted(begins + ends, key=lambda entry: entry[0])

    def perform(self, arm: EmulatedArm, now_s: float) -> None:
        """Do what is due."""
        while self._waiting and self._waiting[0][0] <= arm.script_s(now_s):
            _, do = self._waiting.pop(0)
            do(arm, now_s)

    def wait_s(self, arm: EmulatedArm, now_s: float) -> float:
        """Return seconds until the next action, infinite without one."""
        if not self._waiting:
            return float("inf")
        return max(0.0, self._waiting[0][0] - arm.script_s(now_s))
