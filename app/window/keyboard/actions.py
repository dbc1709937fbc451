"""The one table of what keys do in a flight, and which keys do it at first.

A key is written as text. ``@W`` is a place: where W lies on an American keyboard,
whatever another prints there. ``Q`` is a letter: wherever the keyboard has it. A place
goes before a letter: what its letter asked for is then had where the place's own letter
is printed. ``PageUp`` is a key that has a name. ``Ctrl+``, ``Alt+`` and
``Shift+`` may stand before any of them, in this order.
"""

from collections.abc import Callable, Container
from dataclasses import dataclass
from enum import StrEnum
from itertools import groupby

from app.window.texts import tr
from devices.controls.keyboard import FINE, MOVES, PEDALS


class Act(StrEnum):
    """What a key does; the steering's names are those of `devices.controls.keyboard`.

    The text names it in the user's preferences.
    """

    MOVE_IN = "move in"
    MOVE_OUT = "move out"
    TILT_LEFT = "tilt left"
    TILT_RIGHT = "tilt right"
    TILT_UP = "tilt up"
    TILT_DOWN = "tilt down"
    TURN_LEFT = "turn left"
    TURN_RIGHT = "turn right"
    SLOWLY = "slowly"
    RIGHT_PEDAL = "right pedal"
    LEFT_PEDAL = "left pedal"
    SCOPE_OUT = "scope out"
    ASSIST = "assist"
    HEAD_LEFT = "head left"
    HEAD_RIGHT = "head right"
    NEXT_SCOPE = "next scope"
    PREVIOUS_SCOPE = "previous scope"
    NEXT_TOOL = "next tool"
    PREVIOUS_TOOL = "previous tool"
    WORK = "work"
    SUCTION = "suction"
    WASH = "wash"
    UNDO = "undo"
    TOOL_AHEAD = "tool ahead"
    TOOL_BACK = "tool back"
    TOOL_LEFT = "tool left"
    TOOL_RIGHT = "tool right"
    HOLD = "hold"
    FREEZE = "freeze"
    HINT = "hint"
    GUIDE = "guide"
    MOMENT = "moment"
    ENLARGE = "enlarge"
    KEEP_VIEW = "keep view"
    SOUND = "sound"
    LOUDER = "louder"
    SOFTER = "softer"
    END = "end"
    HELP = "help"
    NAMES = "names"
    SETTINGS = "settings"
    SECOND_SCREEN = "second screen"
    LARGE = "large"
    FULL_SCREEN = "full screen"
    OPEN_HEAD = "open head"
    IMAGING = "imaging"
    FOLLOW = "follow"
    PLANE = "plane"
    WINDOW = "window"
    NARROW = "narrow"
    WIDE = "wide"
    BRIGHTER = "brighter"
    DARKER = "darker"
    PLACE_LEFT = "place left"
    PLACE_RIGHT = "place right"
    PLACE_UP = "place up"
    PLACE_DOWN = "place down"
    SLICE_AHEAD = "slice ahead"
    SLICE_BACK = "slice back"


STEERING = frozenset(Act(name) for name in (*MOVES, *PEDALS, FINE))
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


class Group(StrEnum):
    """A part of the help; its text is its heading."""

    SCOPE = "Scope"
    TOOL = "Tool"
    FLIGHT = "Flight"
    VIEWS = "Views"
    SLICES = "Slices"


@dataclass(frozen=True, slots=True)
class Action:
    """Describe what a key does.

    keys: at first; the first of them can be changed, and is the one that is shown.
    does: a sentence without its full stop, of tool tips and settings. row: of the help;
    actions that follow one another with the same words share a row.
    """

    act: Act
    group: Group
    keys: tuple[str, ...]
    does: str
    row: str


def _rows(group: Group, *rows: tuple[Act, str, str, str]) -> tuple[Action, ...]:
    return tuple(
        Action(act, group, tuple(keys.split()), does, row)
        for act, keys, does, row in rows
    )


_IN, _TILT, _POST = "move in, move out", "tilt about the nostril", "turn the light post"
_HEAD, _SCOPE = "turn the camera head", "next scope, the one before"
_TOOL, _SUCK = "next tool, the one before", "suction; wash the lens"
_ALONG, _ROUND = "tool ahead, back", "turn the tool"
_KEEP, _SOUND = "keep this moment; enlarge it", "sound on or off; its volume"
_WIDTH, _LEVEL = "contrast: narrow, wide window", "brighter, darker"
_PLACE, _SLICE = "move the place", "through the slices"

ACTIONS = (
    *_rows(
        Group.SCOPE,
        (Act.MOVE_IN, "@W", "Moves the scope in while held", _IN),
        (Act.MOVE_OUT, "@S", "Draws the scope back while held", _IN),
        (Act.TILT_LEFT, "Left", "Tilts the scope to the left", _TILT),
        (Act.TILT_RIGHT, "Right", "Tilts the scope to the right", _TILT),
        (Act.TILT_UP, "Up", "Tilts the scope up", _TILT),
        (Act.TILT_DOWN, "Down", "Tilts the scope down", _TILT),
        (Act.TURN_LEFT, "@A", "Turns the light post to the left", _POST),
        (Act.TURN_RIGHT, "@D", "Turns the light post to the right", _POST),
        (Act.SLOWLY, "Shift", "Slows all this down while held", "slowly"),
        (Act.RIGHT_PEDAL, "@1", "Is the right pedal", "right, left pedal"),
        (Act.LEFT_PEDAL, "@2", "Is the left pedal", "right, left pedal"),
        (Act.SCOPE_OUT, "Backspace", "Takes the scope back outside", "back outside"),
        (
            Act.ASSIST,
            "R",
            "Lets an assistant lay the scope for the tool; again: elsewhere",
            "an assistant lays the scope for the tool",
        ),
        (Act.HEAD_LEFT, "@[", "Turns the camera head to the left", _HEAD),
        (Act.HEAD_RIGHT, "@]", "Turns the camera head to the right", _HEAD),
        (Act.NEXT_SCOPE, "@O", "Puts in a scope of another angle", _SCOPE),
        (Act.PREVIOUS_SCOPE, "Shift+@O", "Puts in the scope before", _SCOPE),
    ),
    *_rows(
        Group.TOOL,
        (Act.NEXT_TOOL, "@T", "Puts another tool into the second hand", _TOOL),
        (Act.PREVIOUS_TOOL, "Shift+@T", "Puts in the tool before", _TOOL),
        (
            Act.WORK,
            "@B",
            "Bites, cuts or injects while held",
            "bite or cut, while pressed",
        ),
        (Act.SUCTION, "@N", "Turns the tool's suction on or off", _SUCK),
        (Act.WASH, "@L", "Washes the lens", _SUCK),
        (Act.UNDO, "Z Ctrl+Z", "Takes the last cut back", "undo the last cut"),
        (Act.TOOL_AHEAD, "PageUp", "Moves the tool ahead", _ALONG),
        (Act.TOOL_BACK, "PageDown", "Draws the tool back", _ALONG),
        (Act.TOOL_LEFT, "Home", "Turns the tool to the left", _ROUND),
        (Act.TOOL_RIGHT, "End", "Turns the tool to the right", _ROUND),
        (
            Act.HOLD,
            "@H",
            "Gives the mouse, or the scope's device, to the tool or back",
            "mouse to the tool, or the scope",
        ),
    ),
    *_rows(
        Group.FLIGHT,
        (Act.FREEZE, "P", "Stops the clock; nothing counts", "freeze, go on"),
        (Act.HINT, "I", "Says what helps now", "hint"),
        (
            Act.GUIDE,
            "G",
            "Shows the way to the task's place, or hides it",
            "show the way, or hide it",
        ),
        (Act.MOMENT, "Space", "Keeps this moment, drawn at high quality", _KEEP),
        (Act.ENLARGE, "K", "Enlarges the last moment", _KEEP),
        (Act.KEEP_VIEW, "V", "Saves this view", "save this view"),
        (Act.SOUND, "U", "Turns the sound on or off", _SOUND),
        (Act.LOUDER, "@= +", "Makes the sound louder", _SOUND),
        (Act.SOFTER, "@- -", "Makes the sound softer", _SOUND),
        (Act.END, "Q", "Ends the flight and shows its result", "end the flight"),
    ),
    *_rows(
        Group.VIEWS,
        (Act.HELP, "F1 ?", "Shows all keys", "these keys"),
        (
            Act.NAMES,
            "E",
            "Names what is seen while held",
            "names of what is seen, while held",
        ),
        (Act.SETTINGS, "F2", "Opens the settings", "settings: looks, mouse, keys"),
        (
            Act.SECOND_SCREEN,
            "F3",
            "Shows the scope's picture on a second screen",
            "the scope's picture on a second screen",
        ),
        (
            Act.LARGE,
            "F4",
            "Makes the next view large",
            "large: scope, slices, overview",
        ),
        (Act.FULL_SCREEN, "F", "Fills the screen, or no longer", "full screen"),
        (
            Act.OPEN_HEAD,
            "C",
            "Opens the head in the overview",
            "open the head; drag turns it, wheel zooms",
        ),
    ),
    *_rows(
        Group.SLICES,
        (Act.IMAGING, "M", "Shows CT, MR or both", "CT, MR, both"),
        (
            Act.FOLLOW,
            "F5",
            "Lets the slices stay, or follow the scope",
            "stay at a place; follow the scope",
        ),
        (
            Act.PLANE,
            "F6",
            "Chooses the slices that keys go through",
            "choose axial, coronal, sagittal",
        ),
        (
            Act.WINDOW,
            "F7",
            "Shows bone, soft tissue, or air to bone",
            "bone, soft tissue, air to bone",
        ),
        (Act.NARROW, "Ctrl+Left", "Narrows the window of grey levels", _WIDTH),
        (Act.WIDE, "Ctrl+Right", "Widens the window of grey levels", _WIDTH),
        (Act.BRIGHTER, "Ctrl+Up", "Makes the slices brighter", _LEVEL),
        (Act.DARKER, "Ctrl+Down", "Makes the slices darker", _LEVEL),
        (Act.PLACE_LEFT, "Alt+Left", "Moves the place to the left", _PLACE),
        (Act.PLACE_RIGHT, "Alt+Right", "Moves the place to the right", _PLACE),
        (Act.PLACE_UP, "Alt+Up", "Moves the place up", _PLACE),
        (Act.PLACE_DOWN, "Alt+Down", "Moves the place down", _PLACE),
        (Act.SLICE_AHEAD, "Alt+PageUp", "Goes to the slice ahead", _SLICE),
        (Act.SLICE_BACK, "Alt+PageDown", "Goes to the slice behind", _SLICE),
    ),
)
"""In the order of the help."""

OF = {action.act: action for action in ACTIONS}

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
    listed = [a for a in ACTIONS if a.group is group and a.act not in hidden]
    return [
        (label(*(action.act for action in together)), tr(row))
        for row, together in groupby(listed, key=lambda action: action.row)
    ]
