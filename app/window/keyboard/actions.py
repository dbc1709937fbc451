"""The one table of what keys do in a flight, and which keys at first.

A key is written as text. ``@W`` is a place: where W lies on an American keyboard,
whatever another prints there. ``Q`` is a letter: wherever the keyboard has it. A place
goes before a letter: what its letter asked for is then had where the place's own letter
is printed. ``PageUp`` is a key that has a name. ``Ctrl+``, ``Alt+`` and
``Shift+`` may stand before any of them, in this order.
"""

from collections.abc import Callable, Container
from dataclasses import dataclass
from enum import StrEnum
from functools import partial
from itertools import groupby

from app.window.texts import tr
from devices.controls.keyboard import FINE, MOVES, PEDALS


class Group(StrEnum):
    """A part of the help; its text is its heading."""

    SCOPE = "Scope"
    TOOL = "Tool"
    FLIGHT = "Flight"
    VIEWS = "Views"
    SLICES = "Slices"


@dataclass(frozen=True, slots=True)
class Row:
    """Describe a row of the help; actions that follow one another share it."""

    group: Group
    text: str


_scope = partial(Row, Group.SCOPE)
_tool = partial(Row, Group.TOOL)
_flight = partial(Row, Group.FLIGHT)
_views = partial(Row, Group.VIEWS)
_slices = partial(Row, Group.SLICES)

_IN = _scope("move in, move out")
_TILT = _scope("tilt about the nostril")
_POST = _scope("turn the light post")
_PEDALS = _scope("right, left pedal")
_HEAD = _scope("turn the camera head")
_NEXT_SCOPE = _scope("next scope, the one before")
_NEXT_TOOL = _tool("next tool, the one before")
_SUCTION = _tool("suction; wash the lens")
_ALONG = _tool("tool ahead, back")
_ROUND = _tool("turn the tool")
_KEEP = _flight("keep this moment; enlarge it")
_SOUND = _flight("sound on or off; its volume")
_WIDTH = _slices("contrast: narrow, wide window")
_LEVEL = _slices("brighter, darker")
_PLACE = _slices("move the place")
_SLICE = _slices("through the slices")


class Act(StrEnum):
    """An action, in the order of the help; its text names it in preferences.

    The steering's names are those of `devices.controls.keyboard`. keys: at first; the
    first of them can be changed, and is the one that is shown. does: a sentence without
    its full stop, of tool tips and settings. row: of the help.
    """

    keys: tuple[str, ...]
    does: str
    row: Row

    def __new__(cls, name: str, keys: str, does: str, row: Row) -> "Act":
        """Make an action of a line of the table."""
        act = str.__new__(cls, name)
        act._value_ = name
        act.keys, act.does, act.row = tuple(keys.split()), does, row
        return act

    MOVE_IN = "move in", "@W", "Moves the scope in while held", _IN
    MOVE_OUT = "move out", "@S", "Draws the scope back while held", _IN
    TILT_LEFT = "tilt left", "Left", "Tilts the scope to the left", _TILT
    TILT_RIGHT = "tilt right", "Right", "Tilts the scope to the right", _TILT
    TILT_UP = "tilt up", "Up", "Tilts the scope up", _TILT
    TILT_DOWN = "tilt down", "Down", "Tilts the scope down", _TILT
    TURN_LEFT = "turn left", "@A", "Turns the light post to the left", _POST
    TURN_RIGHT = "turn right", "@D", "Turns the light post to the right", _POST
    SLOWLY = "slowly", "Shift", "Slows all this down while held", _scope("slowly")
    RIGHT_PEDAL = "right pedal", "@1", "Is the right pedal", _PEDALS
    LEFT_PEDAL = "left pedal", "@2", "Is the left pedal", _PEDALS
    SCOPE_OUT = (
        "scope out", "Backspace", "Takes the scope back outside",
        _scope("back outside"),
    )  # fmt: skip
    ASSIST = (
        "assist", "R", "Lets an assistant lay the scope for the tool; again: elsewhere",
        _scope("an assistant lays the scope for the tool"),
    )  # fmt: skip
    HEAD_LEFT = "head left", "@[", "Turns the camera head to the left", _HEAD
    HEAD_RIGHT = "head right", "@]", "Turns the camera head to the right", _HEAD
    NEXT_SCOPE = "next scope", "@O", "Puts in a scope of another angle", _NEXT_SCOPE
    PREVIOUS_SCOPE = (
        "previous scope", "Shift+@O", "Puts in the scope before", _NEXT_SCOPE,
    )  # fmt: skip
    NEXT_TOOL = "next tool", "@T", "Puts another tool into the second hand", _NEXT_TOOL
    PREVIOUS_TOOL = "previous tool", "Shift+@T", "Puts in the tool before", _NEXT_TOOL
    WORK = (
        "work", "@B", "Bites, cuts or injects while held",
        _tool("bite or cut, while pressed"),
    )  # fmt: skip
    SUCTION = "suction", "@N", "Turns the tool's suction on or off", _SUCTION
    WASH = "wash", "@L", "Washes the lens", _SUCTION
    UNDO = "undo", "Z Ctrl+Z", "Takes the last cut back", _tool("undo the last cut")
    TOOL_AHEAD = "tool ahead", "PageUp", "Moves the tool ahead", _ALONG
    TOOL_BACK = "tool back", "PageDown", "Draws the tool back", _ALONG
    TOOL_LEFT = "tool left", "Home", "Turns the tool to the left", _ROUND
    TOOL_RIGHT = "tool right", "End", "Turns the tool to the right", _ROUND
    HOLD = (
        "hold", "@H", "Gives the mouse, or the scope's device, to the tool or back",
        _tool("mouse to the tool, or the scope"),
    )  # fmt: skip
    FREEZE = "freeze", "P", "Stops the clock; nothing counts", _flight("freeze, go on")
    HINT = "hint", "I", "Says what helps now", _flight("hint")
    GUIDE = (
        "guide", "G", "Shows the way to the task's place, or hides it",
        _flight("show the way, or hide it"),
    )  # fmt: skip
    MOMENT = "moment", "Space", "Keeps this moment, drawn at high quality", _KEEP
    ENLARGE = "enlarge", "K", "Enlarges the last moment", _KEEP
    KEEP_VIEW = "keep view", "V", "Saves this view", _flight("save this view")
    SOUND = "sound", "U", "Turns the sound on or off", _SOUND
    LOUDER = "louder", "@= +", "Makes the sound louder", _SOUND
    SOFTER = "softer", "@- -", "Makes the sound softer", _SOUND
    END = "end", "Q", "Ends the flight and shows its result", _flight("end the flight")
    HELP = "help", "F1 ?", "Shows all keys", _views("these keys")
    NAMES = (
        "names", "E", "Names what is seen while held",
        _views("names of what is seen, while held"),
    )  # fmt: skip
    SETTINGS = (
        "settings", "F2", "Opens the settings", _views("settings: looks, mouse, keys"),
    )  # fmt: skip
    SECOND_SCREEN = (
        "second screen", "F3", "Shows the scope's picture on a second screen",
        _views("the scope's picture on a second screen"),
    )  # fmt: skip
    LARGE = (
        "large", "F4", "Makes the next view large",
        _views("large: scope, slices, overview"),
    )  # fmt: skip
    FULL_SCREEN = (
        "full screen", "F", "Fills the screen, or no longer", _views("full screen"),
    )  # fmt: skip
    OPEN_HEAD = (
        "open head", "C", "Opens the head in the overview",
        _views("open the head; drag turns it, wheel zooms"),
    )  # fmt: skip
    IMAGING = "imaging", "M", "Shows CT, MR or both", _slices("CT, MR, both")
    FOLLOW = (
        "follow", "F5", "Lets the slices stay, or follow the scope",
        _slices("stay at a place; follow the scope"),
    )  # fmt: skip
    PLANE = (
        "plane", "F6", "Chooses the slices that keys go through",
        _slices("choose axial, coronal, sagittal"),
    )  # fmt: skip
    WINDOW = (
        "window", "F7", "Shows bone, soft tissue, or air to bone",
        _slices("bone, soft tissue, air to bone"),
    )  # fmt: skip
    NARROW = "narrow", "Ctrl+Left", "Narrows the window of grey levels", _WIDTH
    WIDE = "wide", "Ctrl+Right", "Widens the window of grey levels", _WIDTH
    BRIGHTER = "brighter", "Ctrl+Up", "Makes the slices brighter", _LEVEL
    DARKER = "darker", "Ctrl+Down", "Makes the slices darker", _LEVEL
    PLACE_LEFT = "place left", "Alt+Left", "Moves the place to the left", _PLACE
    PLACE_RIGHT = "place right", "Alt+Right", "Moves the place to the right", _PLACE
    PLACE_UP = "place up", "Alt+Up", "Moves the place up", _PLACE
    PLACE_DOWN = "place down", "Alt+Down", "Moves the place down", _PLACE
    SLICE_AHEAD = "slice ahead", "Alt+PageUp", "Goes to the slice ahead", _SLICE
    SLICE_BACK = "slice back", "Alt+PageDown", "Goes to the slice behind", _SLICE


NAMED = {act.value: act for act in Act}
"""Actions by their names."""

STEERING = frozenset(NAMED[name] for name in (*MOVES, *PEDALS, FINE))
"""What goes to the controls of a scope."""

FIXED = frozenset({Act.SLOWLY})
"""What keeps its key: Shift goes with all others."""

LEFT_HANDED = {
    **{Act.MOVE_IN: "@I", Act.MOVE_OUT: "@K", Act.TURN_LEFT: "@J"},
    **{Act.TURN_RIGHT: "@L", Act.RIGHT_PEDAL: "@0", Act.LEFT_PEDAL: "@9"},
    **{Act.NEXT_TOOL: "@Y", Act.PREVIOUS_TOOL: "Shift+@Y", Act.WORK: "@N"},
    **{Act.SUCTION: "@B", Act.WASH: "@D", Act.HINT: "@W", Act.ENLARGE: "@S"},
}
"""Keys of who holds the mouse in the left hand: the right one steers."""

GESTURES = {
    Group.SCOPE: [
        ("Drag", "tilt; right button: turn the post"),
        ("Wheel", "move in and out"),
    ],
    Group.TOOL: [
        ("Mouse", "the tip goes where it points"),
        ("Wheel", "deeper, back; with Ctrl: the scope"),
        ("Left button", "bite or cut, while pressed"),
        ("Right drag", "tilt the scope"),
    ],
    Group.SLICES: [
        ("Click", "look a place up; twice: follow"),
        ("Right drag", "contrast and brightness"),
        ("Wheel", "through the slices"),
    ],
}
"""What the mouse does, for the help."""


def rows(
    group: Group, label: Callable[..., str], hidden: Container[Act]
) -> list[tuple[str, str]]:
    """Return a group's rows for the help: keys, and what they do.

    label: of some actions. hidden: what this flight does not have.
    """
    listed = [act for act in Act if act.row.group is group and act not in hidden]
    return [
        (label(*together), tr(row.text))
        for row, together in groupby(listed, key=lambda act: act.row)
    ]
