"""The buttons of a flight's page: which there are, what is on, what menus offer."""

from functools import partial

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QWidget

from app.window.flight.flight_thread import DisplayedFrame
from app.window.flight.scope_keys import ScopeKeys, scope_use
from app.window.flight.sound_keys import SoundKeys
from app.window.flight.tool_keys import ToolKeys, tool_use
from app.window.panels.action_bar import ActionBar, ActionButton, Choice
from scenarios.instrument_state import NO_TOOL

Key = Qt.Key

STEERING = (
    ActionButton("In", Key.Key_W, "W", "Moves the scope in while held", is_held=True),
    ActionButton("Out", Key.Key_S, "S", "Draws the scope back while held", True),
    ActionButton("Post ↺", Key.Key_A, "A", "Turns the light post to the left", True),
    ActionButton("Post ↻", Key.Key_D, "D", "Turns the light post to the right", True),
)
"""Where mouse and keys move the scope."""

POST = (
    ActionButton("Post ↺", Key.Key_Left, "←", "Turns the light post", repeats=True),
    ActionButton("Post ↻", Key.Key_Right, "→", "Turns the light post", repeats=True),
)
"""Where another device moves it."""

SCOPE = (
    ActionButton(
        "Head ↺", Key.Key_BracketLeft, "[", "Turns the camera head", repeats=True
    ),
    ActionButton(
        "Head ↻", Key.Key_BracketRight, "]", "Turns the camera head", repeats=True
    ),
    ActionButton("Scope", Key.Key_O, "O", "Puts in a scope of another angle"),
    ActionButton("Wash", Key.Key_L, "L", "Washes the lens"),
)
TOOLS = (
    ActionButton(
        "Tool", Key.Key_T, "T", "Puts another tool into the second hand", is_wide=True
    ),
    ActionButton(
        "Work", Key.Key_B, "B", "Bites, cuts or injects while held", is_held=True
    ),
    ActionButton("Ahead", Key.Key_PageUp, "Pg↑", "Moves the tool ahead", repeats=True),
    ActionButton("Back", Key.Key_PageDown, "Pg↓", "Draws the tool back", repeats=True),
    ActionButton("Suction", Key.Key_N, "N", "Turns the tool's suction on or off"),
    ActionButton("Undo", Key.Key_Z, "Z", "Takes the last cut back"),
    ActionButton("Hold", Key.Key_H, "H", "Holds the scope: its controls move the tool"),
)
TASKS = (
    ActionButton("Freeze", Key.Key_P, "P", "Stops the clock; nothing counts"),
    ActionButton("Hint", Key.Key_I, "I", "Says what helps now"),
)
REST = (
    ActionButton(
        "Moment", Key.Key_Space, "Space", "Keeps this moment, drawn at high quality"
    ),
    ActionButton("Sound", Key.Key_U, "U", "Turns the sound on or off"),
    ActionButton("Screen", Key.Key_F, "F", "Fills the screen, or no longer"),
    ActionButton("End", Key.Key_Q, "Q", "Ends the flight and shows its result"),
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
    ) -> None:
        """Lay out the bar.

        tools: None where the second hand is not the window's. is_steered: mouse and
        keys move the scope. has_tasks: the exercise has any.
        """
        self._tools = tools
        self._sound = sound
        buttons = (STEERING if is_steered else POST) + SCOPE
        buttons += (() if tools is None else TOOLS) + (TASKS if has_tasks else ())
        if tools is None:
            # who washes is the second hand
            buttons = tuple(b for b in buttons if b.key is not Key.Key_L)
        self.bar = ActionBar(page, buttons + REST)
        self.bar.offer(
            Key.Key_O,
            [
                Choice(_scope_name(deg), scope_use(deg), partial(scopes.take, deg))
                for deg in scopes.choices_deg
            ],
        )
        if tools is not None:
            self.bar.offer(
                Key.Key_T,
                [
                    Choice(_tool_name(n), tool_use(n), partial(tools.take, n))
                    for n in tools.names
                ],
            )

    def show_frame(self, frame: DisplayedFrame, *, has_hint: bool) -> None:
        """Show what is in hand and what is on."""
        self.bar.name(Key.Key_O, _scope_name(frame.view.scope_deg))
        self.bar.mark(Key.Key_P, frame.is_frozen)
        self.bar.mark(Key.Key_I, has_hint)
        self.bar.mark(Key.Key_U, self._sound.is_on)
        if self._tools is not None:
            self.bar.name(Key.Key_T, _tool_name(frame.tool.name))
            self.bar.mark(Key.Key_N, frame.tool.is_sucking)
            self.bar.mark(Key.Key_H, self._tools.holds_scope)


def _scope_name(angle_deg: float) -> str:
    return f"{angle_deg:g}° scope"


def _tool_name(name: str) -> str:
    return "No tool" if name == NO_TOOL else name.capitalize()
