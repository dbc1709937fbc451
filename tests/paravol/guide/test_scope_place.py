"""Where an assistant lays a scope: it sees the place, and lies in air."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from anatomy.hazard_volumes import HazardVolumes
from devices.controls.fulcrum import Fulcrum
from paravol.guide.goals import GuidedHead
from paravol.guide.scope_place import (
    APART_MM,
    CLEAR_MM,
    DENT_MM,
    TURNED_MM,
    ScopePlaces,
    ScopePose,
)
from paravol.inputs.pointed_tool import thickness_mm
from paravol.inputs.tool_hold import BESIDE_MM
from paravol.inputs.tool_plan import ToolPlan
from renderers.scene import Volume
from scenarios import Endoscope, FrameState, tip_frame
from scenarios.tasks import Status, TaskState
from scenarios.tasks.task import Inject

H = 0.8
AXIS = (np.arange(101) - 50) * H
FULCRUM = Fulcrum(np.array([0.0, 38.0, 0.0]), np.array([0.0, -1.0, 0.0]))
"""A nostril that is gone into along -y."""

WIDE_MM, WALL_MM = 6.5, -25.0
PLACES = np.array([(4.0, -15.0, 3.0), (0.0, -12.0, 5.0), (-3.0, -22.0, -4.0)])
VALVE_MM = 2.5
OFF_DEG = 32.0
"""Off a picture's middle, at most; its rim lies at 40."""


def cave(valve_mm: float = WIDE_MM) -> Volume:
    """A round way of air along y, with an end; as wide as told at y = 15."""
    z, y, x = np.meshgrid(AXIS, AXIS, AXIS, indexing="ij")
    away = np.hypot(x, z)
    deep = np.maximum(away - WIDE_MM, WALL_MM - y)
    deep = np.maximum(deep, np.minimum(away - valve_mm, 3.0 - np.abs(y - 15.0)))
    return Volume(
        deep.astype(np.float32), np.full(3, H), np.full(3, AXIS[0]), background=9.0
    )


def line_of(pose: ScopePose, radius_mm: float) -> NDArray[np.float64]:
    """Return points of a scope's shaft as far as the nostril, ``(n, 3)``."""
    way = pose.entry_mm - pose.frame[:3, 3]
    length = float(np.linalg.norm(way))
    return (
        pose.frame[:3, 3] + np.linspace(radius_mm, length, 60)[:, None] * way / length
    )


def sees(pose: ScopePose, scope: Endoscope, place: NDArray[np.float64]) -> bool:
    """Return whether a place lies well inside the picture."""
    camera = scope.camera(pose.frame, pose.roll_deg, (64, 64))
    way = place - camera.eye_mm
    across = float(np.linalg.norm(np.cross(camera.frame[3], way)))
    off = math.atan2(across, float(camera.frame[3] @ way))
    return math.degrees(off) < OFF_DEG


@pytest.mark.parametrize("angle_deg", [0.0, 30.0, 45.0, 70.0])
def test_it_lies_in_air_and_sees_a_place(angle_deg: float) -> None:
    scope, air = Endoscope(angle_deg=angle_deg), cave(VALVE_MM)
    poses = list(ScopePlaces(FULCRUM, air, scope, 40.0).looking_at(PLACES, scope))
    assert poses
    radius_mm = scope.diameter_mm / 2
    for number, pose in enumerate(poses):
        assert any(sees(pose, scope, place) for place in PLACES)
        deepest = air.sample(line_of(pose, radius_mm)).max() + radius_mm
        assert deepest < DENT_MM + 0.2
        for other in poses[:number]:
            away = np.linalg.norm(pose.frame[:3, 3] - other.frame[:3, 3])
            assert away > APART_MM - 1e-9


def test_what_sees_most_comes_first_and_then_what_sees_the_rest() -> None:
    scope = Endoscope(angle_deg=70.0)
    right, left = np.array([6.0, -15.0, 0.0]), np.array([-6.0, -15.0, 0.0])
    many = right + np.linspace(-1.0, 1.0, 9)[:, None] * np.array([0.0, 1.0, 0.0])
    found = ScopePlaces(FULCRUM, cave(), scope, 40.0).looking_at(
        np.vstack([left, many]), scope
    )
    first = next(found)
    assert all(sees(first, scope, place) for place in many)
    assert not sees(first, scope, left)
    assert any(sees(next(found), scope, left) for _ in range(6))


def test_nothing_is_seen_through_a_wall() -> None:
    scope = Endoscope(angle_deg=30.0)
    places = ScopePlaces(FULCRUM, cave(), scope, 40.0)
    assert not list(places.looking_at(np.array([[0.0, WALL_MM - 8.0, 0.0]]), scope))


@pytest.mark.parametrize("side", [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)])
def test_it_keeps_away_from_what_must_not_be_hurt(side: tuple[float, float]) -> None:
    """On whichever side it lies."""
    scope, air = Endoscope(angle_deg=0.0), cave()
    away = side[0] * AXIS + (side[1] * AXIS)[:, None, None] + 1.5
    steps = np.broadcast_to(100.0 * np.clip(away, -90.0, 90.0), air.shape)
    near = air.with_values(np.ascontiguousarray(steps, dtype=np.int16), 9000)
    hazards = HazardVolumes({"artery": near})
    first = next(
        ScopePlaces(FULCRUM, air, scope, 40.0, hazards).looking_at(
            np.array([[0.0, WALL_MM, 0.0]]), scope
        )
    )
    gaps = line_of(first, 0.0)[:, ::2] @ np.array(side) + 1.5 - scope.diameter_mm / 2
    assert gaps.min() > CLEAR_MM - 0.1


def test_no_shaft_leans_out_of_its_cone() -> None:
    scope = Endoscope(angle_deg=30.0)
    poses = list(ScopePlaces(FULCRUM, cave(), scope, 6.0).looking_at(PLACES, scope))
    assert poses
    for pose in poses:
        cosine = -pose.frame[:3, 2] @ FULCRUM.axis
        assert math.degrees(math.acos(cosine)) < 6.0 + 1e-6


def test_it_is_drawn_back_until_it_turns_in_air() -> None:
    """From one side of a plate to the other."""
    scope, air = Endoscope(angle_deg=30.0), cave()
    y, x = AXIS[:, None], AXIS
    plate = np.minimum(1.0 - np.abs(x), 10.0 - y)
    air = air.with_values(np.maximum(air.values, plate.astype(np.float32)), 9.0)
    places = ScopePlaces(FULCRUM, air, scope, 40.0)
    poses = list(places.looking_at(PLACES, scope))[:12]
    turned = 0
    for start in poses[::3]:
        for goal in poses:
            drawn_mm = places.drawn_mm(start.frame, goal)
            depth_mm = float(np.linalg.norm(goal.frame[:3, 3] - goal.entry_mm))
            assert 0.0 <= drawn_mm <= depth_mm + 1e-9
            turned += drawn_mm > 0.0 and start.frame[0, 3] * goal.frame[0, 3] < 0.0
            for share in np.linspace(0.0, 1.0, 5):
                # its own line passes the plane of the nostril's middle
                way = -start.frame[:3, 2]
                depth = (start.frame[:3, 3] - FULCRUM.pivot_mm) @ way
                entry = start.frame[:3, 3] - depth * way
                entry = entry + share * (goal.entry_mm - entry)
                line = way + share * (-goal.frame[:3, 2] - way)
                line /= np.linalg.norm(line)
                along = np.arange(0.0, drawn_mm - 3.0, 1.0)[:, None]
                deep = air.sample(entry + along * line) + scope.diameter_mm / 2
                assert deep.max(initial=-1.0) < TURNED_MM + 0.4
    assert turned
    # who lies there already is not drawn back far
    assert places.drawn_mm(poses[0].frame, poses[0]) == pytest.approx(
        float(np.linalg.norm(poses[0].frame[:3, 3] - poses[0].entry_mm)), abs=8.0
    )


WALL = 0.0, WALL_MM, 0.0
INJECT = Inject(name="wall", title="", place=WALL, tool="injection needle")
INJECTS = TaskState("wall", Status.OPEN)


def seen_by(scope: Endoscope) -> FrameState:
    """Return what a scope at the nostril sees, a needle in the other hand."""
    pose = tip_frame(FULCRUM.pivot_mm, FULCRUM.axis)
    camera, nowhere = scope.camera(pose, 0.0, (64, 64)), np.full((4, 4), np.nan)
    return FrameState(
        camera, pose, nowhere, 1.0, instrument=INJECT.tool, scope_deg=30.0
    )


def head_of(air: Volume, plan: ToolPlan) -> GuidedHead:
    pivot = FULCRUM.pivot_mm
    return GuidedHead(air, {}, None, None, pivot, plan=plan, scope_mm=1.35)


def test_a_tool_gets_to_its_place_and_asked_again_from_elsewhere() -> None:
    scope, air = Endoscope(angle_deg=30.0), cave()
    places = ScopePlaces(FULCRUM, air, scope, 40.0)
    head, view = head_of(air, ToolPlan(FULCRUM, air)), seen_by(scope)
    tips: list[NDArray[np.float64]] = []
    for _ in range(3):
        pose = places.for_tool(INJECT, INJECTS, head, view, tips)
        assert pose is not None
        assert pose.goal is not None
        assert pose.goal.is_reached
        assert np.linalg.norm(pose.goal.place_mm - WALL) <= INJECT.radius_mm
        tip = pose.frame[:3, 3]
        assert all(np.linalg.norm(tip - each) >= APART_MM for each in tips)
        tips.append(tip)


def test_without_a_way_for_the_tool_there_is_no_place() -> None:
    scope, air = Endoscope(angle_deg=30.0), cave()
    # a tool gets nowhere, whatever a scope sees
    solid = air.with_values(np.full_like(air.values, 5.0), 9.0)
    head, view = head_of(air, ToolPlan(FULCRUM, solid)), seen_by(scope)
    places = ScopePlaces(FULCRUM, air, scope, 40.0)
    assert places.for_tool(INJECT, INJECTS, head, view) is None


def test_a_scope_leaves_the_tool_in_hand_room() -> None:
    """In a way that is hardly wide enough for both."""
    scope, air = Endoscope(angle_deg=30.0), cave()
    z, x = AXIS[:, None, None], AXIS
    tube = np.maximum(air.values, (np.hypot(x, z) - 4.2).astype(np.float32))
    air = air.with_values(tube, 9.0)
    places = ScopePlaces(FULCRUM, air, scope, 40.0)
    plan, wall = ToolPlan(FULCRUM, air), np.array([[0.0, WALL_MM - 0.4, 0.0]])
    of, entries, ends, worth = plan.lines("straight forceps", wall)
    assert len(of)
    assert (worth > 0.0).all()
    room = places._room(plan, "straight forceps", wall)
    poses = list(places.looking_at(wall, scope, (), room))
    assert poses
    others = list(places.looking_at(wall, scope))
    blocked = 0
    apart_mm = scope.diameter_mm / 2 + thickness_mm("straight forceps")
    for number, pose in enumerate([*poses, *others]):
        back = pose.frame[:3, 2]
        shaft = pose.frame[:3, 3] + np.linspace(0.0, BESIDE_MM, 33)[:, None] * back
        share = np.linspace(0.0, 1.0, 400)[:, None, None]
        lines = entries + share * (ends - entries)
        gaps = np.linalg.norm(lines[:, :, None] - shaft, axis=3).min(axis=(0, 2))
        blocked += gaps.max() < apart_mm
        assert number >= len(poses) or gaps.max() > apart_mm - 0.1
    assert blocked
