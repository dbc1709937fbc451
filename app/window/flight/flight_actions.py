"""The buttons of a flight's page: which there are, what is on, what menus offer."""

from functools import partial

from app.window.flight.flight_thread import DisplayedFrame
from app.window.flight.tool_keys import ToolKeys, tool_use
from app.window.flight.view_keys import ScopeKeys, SoundKeys, scope_use
from app.window.keyboard.actions import Act
from app.window.keyboard.page_commands import Commands
from app.window.panels.action_bar import ActionBar, Choice
from app.window.texts import later, tr
from scenarios.instrument_state import NO_TOOL

STEERING = {
    Act.MOVE_IN: later("In"),
    Act.MOVE_OUT: later("Out"),
    Act.TURN_LEFT: later("Post ↺"),
    Act.TURN_RIGHT: later("Post ↻"),
    Act.SCOPE_OUT: later("Outside"),
}
"""Where mouse and keys move the scope."""

POST = {act: STEERING[act] for act in (Act.TURN_LEFT, Act.TURN_RIGHT)}
"""Where another device moves it."""

SCOPE = {
    Act.HEAD_LEFT: later("Head ↺"),
    Act.HEAD_RIGHT: later("Head ↻"),
    Act.NEXT_SCOPE: later("Scope"),
}
ASSIST = {Act.ASSIST: later("Assist")}
"""Where an assistant may hold the scope for a tool."""

TOOLS = {
    Act.WASH: later("Wash"),
    Act.NEXT_TOOL: later("Tool"),
    Act.WORK: later("Work"),
    Act.TOOL_AHEAD: later("Ahead"),
    Act.TOOL_BACK: later("Back"),
    Act.SUCTION: later("Suction"),
    Act.UNDO: later("Undo"),
    Act.HOLD: later("Mouse"),
}
TASKS = {
    Act.FREEZE: later("Freeze"),
    Act.HINT: later("Hint"),
    Act.GUIDE: later("Way"),
}
REST = {
    Act.NAMES: later("Names"),
    Act.MOMENT: later("Moment"),
    Act.SOUND: later("Sound"),
    Act.FULL_SCREEN: later("Screen"),
    Act.END: later("End"),
}


class FlightActions:
    """Fill the bar of a flight's page, and keep it up to date."""

    def __init__(
        self,
        commands: Commands,
        scopes: ScopeKeys,
        tools: ToolKeys | None,
        sound: SoundKeys,
        *,
        is_steered: bool,
    ) -> None:
        """Lay out the bar for what can be done in the flight.

        tools: None where the second hand is not the window's. is_steered: mouse and
        keys move the scope.
        """
        self._tools = tools
        self._sound = sound
        labels = (STEERING if is_steered else POST) | SCOPE
        if tools is not None:
            labels |= ASSIST | TOOLS
        labels |= TASKS | REST
        shown = {act: label for act, label in labels.items() if act in commands}
        self.bar = ActionBar(shown, commands)
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
