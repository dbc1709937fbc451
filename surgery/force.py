"""The force that tissue returns to a tool: what a hand feels, or would feel.

`ToolForce` follows one tool by recorded samples and gives the same forces in every
replay. A loop of 1 kHz calls the same compiled tick (`surgery.kernels.touch_force`)
with copies of the distance, so that no cut changes what it reads.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from anatomy.feel import feel_of, ground_stiffness
from anatomy.wall_layers import WallLayers
from surgery import solids
from surgery.kernels import touch_force as tick
from surgery.kernels.distance_field import HOLE
from surgery.kernels.squeeze_jaws import squeeze_jaws
from surgery.kernels.touch_force import Patch
from surgery.patient import OperatedPatient
from surgery.straight_way import is_way
from system import UserError

Doubles = NDArray[np.float64]

MOST_BALLS = 200
"""Of which a tool is made."""

APART = 0.8
"""Balls along a capsule are so many radii apart: one is a twelfth thinner between."""

FELT_MM = 60.0
"""So much of a tool, from its tip, is felt: deeper no passage is."""

SEALED_KPA = 20.0
"""Suction of an operating room, 150 mmHg, behind an opening that tissue seals."""

STEPS_PER_S, MOST_STEPS = 100.0, 10
"""Ticks on the way between two samples, of their time, and at most."""

ABSENT_S = 0.25
"""Longer than this between two samples, a tool was away."""


@dataclass(frozen=True, slots=True)
class RigidPart:
    """A part of a tool.

    capsules: rows of `surgery.solids`, in the tool's frame when its jaws are closed.
    pose: gives the part's 4x4 turn for a jaw from 0, open, to 1; None for what never
    moves.
    """

    capsules: solids.Rows
    pose: Callable[[float], Doubles] | None = None


@dataclass(frozen=True, slots=True)
class Touch:
    """What a tool feels.

    newton: ``(3,)`` on the tool, patient frame. torque_nmm: ``(3,)`` about its origin.
    size_n: of the tissue alone, the largest since the last sample. depth_mm: how far
    the hand is beyond where tissue holds the tool. wall: the name of the bone behind
    what is touched, "" for none. place_mm: ``(3,)`` of the touch. jaw_n: what closing
    jaws feel. held_mm: tissue between them. broken: walls that broke since the last
    sample. flags: of `surgery.kernels.touch_force`.
    """

    newton: Doubles
    torque_nmm: Doubles
    size_n: float = 0.0
    depth_mm: float = 0.0
    wall: str = ""
    place_mm: Doubles | None = None
    jaw_n: float = 0.0
    held_mm: float = 0.0
    broken: tuple[str, ...] = ()
    flags: int = 0

    @property
    def is_touching(self) -> bool:
        """Return whether tissue holds the tool."""
        return bool(self.flags & tick.TOUCHING)


NO_TOUCH = Touch(np.zeros(3), np.zeros(3))


@dataclass(frozen=True, slots=True)
class ForceState:
    """A tool's proxy and holes at one moment; see `ToolForce.checkpoint`."""

    state: Doubles
    holes: Doubles
    last: tuple[float, Doubles] | None
    touch: Touch


@dataclass(frozen=True, slots=True)
class JawContact:
    """What lies between a tool's jaws.

    points_mm: ``(n, 3)`` evenly in what they enclose, wide open, in the tool's frame.
    gape_mm: how wide that is.
    """

    points_mm: Doubles
    gape_mm: float


def feel_tables(layers: WallLayers) -> tuple[Doubles, Doubles]:
    """Return the tables of walls ``(256, FEEL)`` and of grounds ``(256,)``."""
    walls = np.zeros((256, tick.FEEL))
    for row, kind in enumerate(layers.kinds):
        feel = feel_of(kind)
        walls[row] = (
            kind.mucosa_mm,
            kind.bone_mm,
            feel.soft_n_mm,
            feel.hard_n_mm,
            feel.friction,
            feel.damping_ns_mm,
            kind.fracture_n if kind.bone_mm > 0 else 0.0,
        )
    return walls, ground_stiffness()


class Yielding:
    """Tell how deep a force presses a tool into whole walls.

    walls, grounds: rows by voxel; dents_mm: ``(256, 256)`` by both. See
    `surgery.kernels.touch_force` for how tissue feels.
    """

    def __init__(self, layers: WallLayers, newton: float) -> None:
        """Take what walls are made of."""
        self.walls, self.grounds = layers.wall.values, layers.ground.values
        self._layers = layers
        table, under = feel_tables(layers)
        wall = table.T[..., None]
        mucosa = wall[tick.MUCOSA_MM]
        soft = np.where(mucosa > 0.0, wall[tick.SOFT], under)
        share = np.minimum(wall[tick.BONE_MM] / tick.RAMP_MM, 1.0)
        hard = under + share * (wall[tick.HARD] - under)
        gives = np.minimum(newton / soft, tick.PRESSED * mucosa)
        self.dents_mm: Doubles = gives + (newton - soft * gives) / hard

    def at(self, places: Doubles) -> Doubles:
        """Return how deep that is at places ``(n, 3)``, mm."""
        wall, ground = (
            each.nearest(places, 0).astype(np.intp)
            for each in (self._layers.wall, self._layers.ground)
        )
        found: Doubles = self.dents_mm[wall, ground]
        return found


def whole_patch(patient: OperatedPatient) -> Patch:
    """Return the patient's own fields: for whoever reads between edits."""
    distance, layers = patient.surface.distance, patient.layers
    return Patch(
        distance.values,
        np.ascontiguousarray(distance.voxel_from_world[:3]),
        patient.pristine.distance.values,
        layers.wall.values,
        layers.ground.values,
    )


def balls_of(parts: Sequence[solids.Rows]) -> tuple[Doubles, NDArray[np.int64]]:
    """Return balls ``(n, 4)``, middle and radius, along capsules; the part of each.

    parts: capsules of `surgery.solids`, in the tool's frame, +z back up the shaft.
    """
    rows = np.concatenate(parts)
    if len(rows) == 0 or np.any(rows[:, 0] != solids.CAPSULE):
        raise UserError("a tool that is felt is made of capsules, at least one")
    if len(rows) > MOST_BALLS // 2 or np.any(rows[:, 7] <= 0.0):
        raise UserError(
            f"a tool that is felt is made of {MOST_BALLS // 2} capsules at most, with "
            f"radii; got {len(rows)} down to {rows[:, 7].min()} mm"
        )
    begin, end, radius = rows[:, 1:4], rows[:, 4:7].copy(), rows[:, 7]
    # what is farther up the shaft than is felt, cut off
    long = (end[:, 2] > FELT_MM) & (begin[:, 2] < FELT_MM)
    share = (FELT_MM - begin[long, 2]) / (end[long, 2] - begin[long, 2])
    end[long] = begin[long] + share[:, None] * (end[long] - begin[long])
    kept = np.flatnonzero(begin[:, 2] < FELT_MM)
    lengths = np.linalg.norm(end - begin, axis=1)
    apart = APART
    while True:
        counts = np.ceil(lengths / (apart * radius)).astype(int) + 1
        if counts[kept].sum() <= MOST_BALLS:
            break
        apart *= 1.25
    places = [np.linspace(begin[n], end[n], counts[n]) for n in kept]
    owner = np.repeat(np.arange(len(parts)), [len(part) for part in parts])
    each = counts[kept]
    balls = np.column_stack([np.concatenate(places), np.repeat(radius[kept], each)])
    return np.ascontiguousarray(balls), np.repeat(owner[kept], each)


def warm_up(patient: OperatedPatient) -> None:
    """Compile what is called, or fetch it compiled, before a flight begins."""
    ball = solids.capsule([0, 0, 1], [0, 0, 1], 1.0)
    gape = JawContact(np.zeros((1, 3)), 1.0)
    tool = ToolForce(patient, [RigidPart(ball)], gape=gape)
    tool.step(0.0, np.eye(4))


class ToolForce:
    """Follow one tool through recorded samples: what it feels, what breaks under it.

    touch: of the newest sample.
    """

    def __init__(
        self,
        patient: OperatedPatient,
        parts: Sequence[RigidPart],
        *,
        gape: JawContact | None = None,
        bore_mm: float = 0.0,
    ) -> None:
        """Take a tool; gape: of its jaws, where it has any; bore_mm: that sucks."""
        self._patient = patient
        self._felt = whole_patch(patient), *feel_tables(patient.layers)
        self._gape = gape
        self._jaw = 1.0
        self._balls, owner = balls_of([part.capsules for part in parts])
        closed = self._balls[:, :3].copy()
        self._moving = [
            (part.pose, owner == n, closed[owner == n])
            for n, part in enumerate(parts)
            if part.pose is not None
        ]
        # N of kPa times mm2
        self._pull_n = SEALED_KPA * 1e-3 * math.pi / 4 * bore_mm**2
        self._settings = np.zeros(tick.SETTINGS)
        self._settings[tick.STIFFEST] = self._settings[tick.MOST_N] = math.inf
        # the end of the tip is the tool's origin
        away = np.linalg.norm(self._balls[:, :3], axis=1) - self._balls[:, 3]
        self._settings[tick.PULL_BALL] = int(np.argmin(away))
        self._state = np.zeros(tick.STATE)
        self._holes = np.zeros(tick.HOLES)
        self._work = np.zeros((len(self._balls) + tick.BEHIND, tick.WORK))
        self._out = np.zeros(tick.OUT)
        self._kept = self._state, self._holes, self._work, self._out
        self._way = np.zeros((3, 4, 4))
        self._last: tuple[float, Doubles] | None = None
        self.touch = NO_TOUCH

    def step(
        self,
        time_s: float,
        world_from_tool: Doubles,
        jaw: float = 1.0,
        is_sucking: bool = False,
        held: bool = False,
        bites: bool = False,
    ) -> Touch:
        """Take in one sample; samples come in order of time.

        held: walls hold it already, and nobody feels it: no proxy stays behind, and
        what it presses follows from how deep it lies. bites: its jaws go about what
        they take, and push nothing aside.

        world_from_tool: 4x4; one that is not finite is no pose: no force. Tissue is
        read as it is now.
        """
        if jaw != self._jaw:
            self._jaw = jaw
            for pose_of, mine, closed in self._moving:
                pose = pose_of(jaw)
                self._balls[mine, :3] = closed @ pose[:3, :3].T + pose[:3, 3]
        if bites:
            self._state[tick.HAS] = 0.0
        before = self._last
        elapsed_s = 0.0 if before is None else time_s - before[0]
        self._way[1] = world_from_tool
        if before is None or not 0.0 < elapsed_s <= ABSENT_S:
            if before is not None and elapsed_s == 0.0:
                return self.touch
            self._state[tick.HAS] = 0.0
            self._way[0] = world_from_tool
            elapsed_s = 1.0 / STEPS_PER_S
        else:
            self._way[0] = before[1]
            moved_mm = np.linalg.norm(world_from_tool[:3, 3] - before[1][:3, 3])
            if not is_way(float(moved_mm), elapsed_s):
                self._state[tick.HAS] = 0.0
                self._way[0] = world_from_tool
        is_pose = bool(np.isfinite(self._way[1]).all())
        broken = int(self._state[tick.BROKEN])
        if held and is_pose and not bites:
            flags = tick.press_walls(
                *self._felt, self._balls, self._way[1], *self._kept
            )
        else:
            flags = self._follow(elapsed_s, is_sucking)
        self._last = time_s, self._way[1].copy()
        self.touch = self._told(flags, broken, jaw if is_pose else None)
        return self.touch

    def _follow(self, elapsed_s: float, is_sucking: bool) -> int:
        """Let the proxy follow the hand on its way from the sample before."""
        steps = 1
        if np.isfinite(self._way[:2]).all():
            steps = min(math.ceil(elapsed_s * STEPS_PER_S - 1e-6), MOST_STEPS)
        self._settings[tick.DT] = self._settings[tick.PERIOD] = elapsed_s / steps
        self._settings[tick.PULL_N] = self._pull_n if is_sucking else 0.0
        return tick.follow_way(
            *self._felt, self._balls, self._way, steps, self._settings, *self._kept
        )

    @property
    def has_jaws(self) -> bool:
        """Return whether it bites."""
        return self._gape is not None

    def inherit(self, other: "ToolForce") -> None:
        """Find the holes open that another tool has broken."""
        self._holes[:] = other._holes
        self._state[tick.BROKEN] = other._state[tick.BROKEN]

    def checkpoint(self) -> ForceState:
        """Return all that later samples may change."""
        return ForceState(
            self._state.copy(), self._holes.copy(), self._last, self.touch
        )

    def restore(self, state: ForceState) -> None:
        """Go back, or on, to a state of this tool."""
        self._state[:], self._holes[:] = state.state, state.holes
        self._last, self.touch = state.last, state.touch

    def _told(self, flags: int, before: int, jaw: float | None) -> Touch:
        """Turn a tick's numbers into words."""
        out, kinds = self._out, self._patient.layers.kinds
        touch = Touch(
            out[tick.FORCE : tick.FORCE + 3].copy(),
            out[tick.TORQUE : tick.TORQUE + 3].copy(),
            size_n=float(out[tick.TISSUE_N]),
            flags=flags,
        )
        now = int(self._state[tick.BROKEN])
        if now > before:
            rows = [
                int(self._holes[n % tick.MOST_HOLES, HOLE - 1])
                for n in range(max(before, now - tick.MOST_HOLES), now)
            ]
            touch = replace(touch, broken=tuple(kinds[row].name for row in rows))
        if flags & tick.TOUCHING:
            touch = replace(
                touch,
                depth_mm=float(out[tick.DEPTH]),
                wall=kinds[int(out[tick.ROW])].name,
                place_mm=out[tick.PLACE : tick.PLACE + 3].copy(),
            )
        if self._gape is not None and jaw is not None and jaw > 0.0:
            gape = self._gape
            force, held = squeeze_jaws(
                *self._felt, gape.points_mm, self._way[1], gape.gape_mm, jaw
            )
            touch = replace(touch, jaw_n=force, held_mm=held)
        return touch
