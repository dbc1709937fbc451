"""The buttons of a flight's page: which there are, what is on, what menus offer."""

from functools import partial

from PySide6.QtWidgets import QWidget

from app.window.flight.flight_thread import DisplayedFrame
from app.window.flight.scope_keys import ScopeKeys, scope_use
from app.window.flight.sound_keys import SoundKeys
from app.window.flight.tool_keys import ToolKeys, tool_use
from app.window.keyboard.actions import Act
from app.window.panels.action_bar import ActionBar, ActionButton, Choice
from app.window.texts import later, tr
from scenarios.instrument_state import NO_TOOL

STEERING = (
    ActionButton(Act.MOVE_IN, later("In"), is_held=True),
    ActionButton(Act.MOVE_OUT, later("Out"), is_held=True),
    ActionButton(Act.TURN_LEFT, later("Post ↺"), is_held=True),
    ActionButton(Act.TURN_RIGHT, later("Post ↻"), is_held=True),
    ActionButton(Act.SCOPE_OUT, later("Outside")),
)
"""Where mouse and keys move the scope."""

POST = (
    ActionButton(Act.TURN_LEFT, later("Post ↺"), repeats=True),
    ActionButton(Act.TURN_RIGHT, later("Post ↻"), repeats=True),
)
"""Where another device moves it."""

SCOPE = (
    ActionButton(Act.HEAD_LEFT, later("Head ↺"), repeats=True),
    ActionButton(Act.HEAD_RIGHT, later("Head ↻"), repeats=True),
    ActionButton(Act.NEXT_SCOPE, later("Scope")),
)
ASSIST = (ActionButton(Act.ASSIST, later("Assist")),)
"""Where an assistant may hold the scope."""

WASH = (ActionButton(Act.WASH, later("Wash")),)
"""Who washes is the second hand."""

TOOLS = (
    ActionButton(Act.NEXT_TOOL, later("Tool"), is_wide=True),
    ActionButton(Act.WORK, later("Work"), is_held=True),
    ActionButton(Act.TOOL_AHEAD, later("Ahead"), repeats=True),
    ActionButton(Act.TOOL_BACK, later("Back"), repeats=True),
    ActionButton(Act.SUCTION, later("Suction")),
    ActionButton(Act.UNDO, later("Undo")),
    ActionButton(Act.HOLD, later("Mouse")),
)
TASKS = (
    ActionButton(Act.FREEZE, later("Freeze")),
    ActionButton(Act.HINT, later("Hint")),
    ActionButton(Act.GUIDE, later("Way")),
)
REST = (
    ActionButton(Act.NAMES, later("Names"), is_held=True),
    ActionButton(Act.MOMENT, later("Moment")),
    ActionButton(Act.SOUND, later("Sound")),
    ActionButton(Act.FULL_SCREEN, later("Screen")),
    ActionButton(Act.END, later("End")),
)


class FlightActions:
    """Fill the bar of a flight's page, and keep it up to date."""

    def __init__(
        self,
        page: QWidget,
        scopes: ScopeKeys,
        tools: ToolKeys | None,
        sound: SoundKeys,
        *,
        is_steered: bool,
        has_tasks: bool,
        has_assistant: bool,
    ) -> None:
        """Lay out the bar.

        tools: None where the second hand is not the window's. is_steered: mouse and
        keys move the scope. has_tasks: the exercise has any.
        has_assistant: one may lay the scope.
        """
        self._tools = tools
        self._sound = sound
        buttons = (STEERING if is_steered else POST) + SCOPE
        buttons += ASSIST if tools is not None and has_assistant else ()
        buttons += (() if tools is None else WASH + TOOLS) + (
            TASKS if has_tasks else ()
        )
        self.bar = ActionBar(page, buttons + REST)
        self.bar.offer(
            Act.NEXT_SCOPE,
            [
                Choice(_scope_name(deg), scope_use(deg), partial(scopes.take, deg))
                for deg in scopes.choices_deg
            ],
        )
        if tools is not None:
            self.bar.offer(
                Act.NEXT_TOOL,
                [
                    Choice(_tool_name(n), tool_use(n), partial(tools.take, n))
                    for n in tools.names
                ],
            )

    def show_frame(
        self, frame: DisplayedFrame, *, has_hint: bool, has_guide: bool
    ) -> None:
        """Show what is in hand and what is on."""
        self.bar.name(Act.NEXT_SCOPE, _scope_name(frame.view.scope_deg))
        self.bar.mark(Act.FREEZE, frame.is_frozen)
        self.bar.mark(Act.HINT, has_hint)
        self.bar.mark(Act.GUIDE, has_guide)
        self.bar.mark(Act.SOUND, self._sound.is_on)
        if self._tools is not None:
            self.bar.name(Act.NEXT_TOOL, _tool_name(frame.tool.name))
            self.bar.mark(Act.SUCTION, frame.tool.is_sucking)
            self.bar.mark(Act.HOLD, self._tools.has_control)


def _scope_name(angle_deg: float) -> str:
    return tr("{angle_deg:g}° scope", angle_deg=angle_deg)


def _tool_name(name: str) -> str:
    return tr("No tool") if name == NO_TOOL else tr(name.capitalize())
