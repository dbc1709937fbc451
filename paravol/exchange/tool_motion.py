"""How tools moved, as other programs keep it: named transforms with times.

Our files and memory are in the patient's LPS frame; PerkTutor and 3D Slicer work in
RAS. Only the patient's side is turned: a tool keeps its own axes, its tip at the origin
and +z running back up the shaft. Slicer's names say both ends: ``ScopeTipToRas``.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenarios.bundle import EventRecord, Recording
from scenarios.endoscope import tip_frame
from scenarios.instrument_state import NO_TOOL
from scenarios.sample import tool_frame
from system import UserError

Doubles = NDArray[np.float64]

SCOPE, INSTRUMENT = "ScopeTipToRas", "InstrumentTipToRas"

MOST_FRAMES = 2_000_000
"""Half an hour of 1 kHz; a file with more is a mistaken one."""

LARGEST_FILE = 1 << 30
"""Bytes that are read of a file of another program, pictures not counted."""

FARTHEST_MM = 1e6
"""A pose farther away than a kilometre is none."""

LATEST_S = 1e12
"""Of a time stamp; clocks count from 1970."""

RIGID = 1e-3
"""How far a rotation may be from one and still be a pose; files keep few digits."""


@dataclass(frozen=True)
class ToolMotion:
    """The poses of one tool.

    name: of the transform, without "Transform" at its end. time_s: ``(n,)``, as they
    came. world_from_tool: ``(n, 4, 4)`` patient LPS, mm. valid: ``(n,)``; where not,
    the pose means nothing.
    """

    name: str
    time_s: Doubles
    world_from_tool: Doubles
    valid: NDArray[np.bool_]

    def __post_init__(self) -> None:
        count = len(self.time_s)
        if self.world_from_tool.shape != (count, 4, 4) or len(self.valid) != count:
            raise UserError(f"{self.name} has not a pose for each of {count} times")

    @property
    def rising(self) -> NDArray[np.intp]:
        """Return the places of the valid poses at which time goes on."""
        good = self.valid & (np.abs(self.time_s) < LATEST_S)
        good &= are_poses(self.world_from_tool)
        places = np.flatnonzero(good)
        times = self.time_s[places]
        before = np.concatenate([[-np.inf], np.maximum.accumulate(times)[:-1]])
        return places[times > before[: len(places)]]


@dataclass(frozen=True)
class Message:
    """What happened when."""

    time_s: float
    text: str


@dataclass(frozen=True)
class Motions:
    """The tools of a recording, and what happened meanwhile."""

    tools: tuple[ToolMotion, ...]
    messages: tuple[Message, ...] = ()


def ras_from_lps(matrices: Doubles) -> Doubles:
    """Return world_ras_from_tool of world_lps_from_tool ``(n, 4, 4)``, and back."""
    turned = matrices.copy()
    turned[:, :2] *= -1.0
    return turned


def are_poses(matrices: Doubles) -> NDArray[np.bool_]:
    """Return which of ``(n, 4, 4)`` turn and move, and do nothing else."""
    good: NDArray[np.bool_] = np.asarray(np.isfinite(matrices).all(axis=(1, 2)))
    matrices = np.where(good[:, None, None], matrices, 0.0)
    # numbers that overflow when multiplied are no rotation either
    turns = np.clip(matrices[:, :3, :3], -2.0, 2.0)
    square = turns @ turns.transpose(0, 2, 1) - np.eye(3)
    good &= np.abs(square).max(axis=(1, 2), initial=0.0) <= RIGID
    good &= np.linalg.det(turns) > 0.0
    good &= np.abs(matrices[:, :3, 3]).max(axis=1, initial=0.0) < FARTHEST_MM
    good &= (matrices[:, 3] == [0.0, 0.0, 0.0, 1.0]).all(axis=1)
    return good


def motions_of(recording: Recording) -> Motions:
    """Return a recorded session's tools: the scope with the roll of its light post.

    The instrument is invalid while the hand is empty.
    """
    samples = [record.sample() for record in recording.samples]
    if not samples:
        raise UserError("The session holds no sample; there is nothing to export.")
    info = recording.info
    matrix = np.array(info.world_from_device).reshape(4, 4)
    times = np.array([s.time_s for s in samples])
    scope, instrument = np.empty((2, len(samples), 4, 4))
    has_tool = np.empty(len(samples), np.bool_)
    scope_good = np.empty(len(samples), np.bool_)
    for i, sample in enumerate(samples):
        tip = matrix @ sample.device_from_tip
        scope_good[i] = are_poses(tip[None])[0]
        scope[i] = np.eye(4)
        if scope_good[i]:
            scope[i] = tip_frame(tip[:3, 3], -tip[:3, 2], sample.roll_deg)
        has_tool[i] = sample.instrument.name != NO_TOOL
        has_tool[i] &= info.has_instrument or info.operated
        instrument[i] = tool_frame(sample) if has_tool[i] else np.eye(4)
    messages = tuple(
        Message(record.time_s, f"{record.kind}: {record.text}")
        for record in recording.records
        if isinstance(record, EventRecord)
    )
    tools = [ToolMotion(SCOPE, times, scope, scope_good)]
    if has_tool.any():
        has_tool &= are_poses(instrument)
        tools.append(ToolMotion(INSTRUMENT, times, instrument, has_tool))
    return Motions(tuple(tools), messages)


def tool_named(tools: Sequence[ToolMotion], name: str) -> ToolMotion:
    """Return the tool of a name, with or without "Transform"; UserError lists all."""
    wanted = name.removesuffix("Transform")
    for tool in tools:
        if tool.name == wanted:
            return tool
    known = ", ".join(tool.name for tool in tools) or "none"
    raise UserError(f"There is no transform {wanted!r}; those there are: {known}.")
