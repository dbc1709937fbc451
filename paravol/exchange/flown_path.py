"""A probe path that can be flown, of a recording that another program made."""

import math
from pathlib import Path
from typing import Literal

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from devices import ProbePath
from paravol.exchange.perktutor import read_perktutor
from paravol.exchange.sequence_file import ENDINGS, read_sequence
from paravol.exchange.tool_motion import (
    SCOPE,
    Doubles,
    Motions,
    ToolMotion,
    motions_of,
    ras_from_lps,
    tool_named,
)
from paravol.inputs.pose_completer import AWAY_MM
from scenarios.bundle import read_recording
from scenarios.endoscope import tip_frame
from system import UserError

Pointing = Literal["+x", "-x", "+y", "-y", "+z", "-z"]
"""The tool's own axis from the hand to the tip; ours point along -z."""


def read_motions(file: Path, frame: Literal["ras", "lps"] = "ras") -> Motions:
    """Read a recording of tools: a session's folder, PerkTutor's XML, a sequence file.

    frame: of what the file's poses end in. UserError where it is none of them.
    """
    if file.is_dir():
        return motions_of(read_recording(file))
    if file.suffix == ".xml":
        motions = read_perktutor(file)
    elif file.suffix in ENDINGS:
        motions = read_sequence(file)
    else:
        raise UserError(
            f"{file} is no recording that can be read: a session's folder, an .xml of "
            f"PerkTutor or a sequence ({', '.join(ENDINGS)})."
        )
    if frame == "ras":
        return motions
    tools = tuple(
        ToolMotion(t.name, t.time_s, ras_from_lps(t.world_from_tool), t.valid)
        for t in motions.tools
    )
    return Motions(tools, motions.messages)


def path_of(
    motions: Motions,
    name: str,
    *,
    scope: str | None = None,
    instrument: str | None = None,
    pointing: Pointing = "-z",
) -> ProbePath:
    """Return the path of a scope, and of an instrument beside it.

    name: of the path. scope, instrument: names of transforms; None for ours, or for a
    scope that is the only tool there is. What is invalid, or came with a time that is
    not later, is left out; between two poses both tools move evenly. Without an
    instrument the second hand is far away.
    """
    known = {tool.name for tool in motions.tools}
    if scope is None:
        scope = next(iter(known)) if len(known) == 1 else SCOPE
    tool = tool_named(motions.tools, scope)
    places = tool.rising
    if len(places) < 2:
        raise UserError(
            f"{tool.name} has {len(places)} valid poses in the order of time; a path "
            "needs two."
        )
    times = tool.time_s[places]
    frames = _turned(tool.world_from_tool[places], pointing)
    tip, axis = frames[:, :3, 3], -frames[:, :3, 2]
    second_tip = np.tile(AWAY_MM, (len(times), 1))
    second_axis = np.tile([0.0, 1.0, 0.0], (len(times), 1))
    if instrument is not None:
        second = tool_named(motions.tools, instrument)
        second_frames = _at(second, times, pointing)
        second_tip, second_axis = second_frames[:, :3, 3], -second_frames[:, :3, 2]
    roll_deg = np.degrees(np.unwrap(np.radians([_roll_deg(f) for f in frames])))
    return ProbePath(
        name=name,
        source=f"imported: {tool.name}",
        t_s=times - times[0],
        tip_mm=tip,
        axis=axis,
        roll_deg=roll_deg,
        instrument_tip_mm=second_tip,
        instrument_axis=second_axis,
        buttons=np.zeros(len(times), np.int64),
    )


def _turned(frames: Doubles, pointing: Pointing) -> Doubles:
    """Return the frames with +z back up the shaft."""
    sign = 1.0 if pointing[0] == "+" else -1.0
    axis = "xyz".index(pointing[1])
    turn = np.zeros((4, 4))
    turn[3, 3] = 1.0
    turn[axis, 2] = -sign
    if axis == 2:
        turn[0, 0], turn[1, 1] = 1.0, -sign
    else:
        turn[(axis + 1) % 3, 0] = 1.0
        turn[:3, 1] = np.cross(turn[:3, 2], turn[:3, 0])
    turned: Doubles = frames @ turn
    # digits were cut off in the file: back to unit length
    turned[:, :3, :3] = Rotation.from_matrix(turned[:, :3, :3]).as_matrix()
    return turned


def _at(tool: ToolMotion, times: Doubles, pointing: Pointing) -> Doubles:
    """Return a tool's frames at other times; it stands still before and after."""
    places = tool.rising
    if len(places) < 2:
        raise UserError(f"{tool.name} has {len(places)} valid poses; a path needs two.")
    own = tool.time_s[places]
    frames = _turned(tool.world_from_tool[places], pointing)
    wanted = np.clip(times, own[0], own[-1])
    placed = np.tile(np.eye(4), (len(times), 1, 1))
    turns = Slerp(own, Rotation.from_matrix(frames[:, :3, :3]))
    placed[:, :3, :3] = turns(wanted).as_matrix()
    for k in range(3):
        placed[:, k, 3] = np.interp(wanted, own, frames[:, k, 3])
    return placed


def _roll_deg(frame: Doubles) -> float:
    """Return the turn that `tip_frame` needs for a frame's x and y."""
    upright = tip_frame(frame[:3, 3], -frame[:3, 2])
    x = frame[:3, 0]
    return -math.degrees(math.atan2(x @ upright[:3, 1], x @ upright[:3, 0]))
