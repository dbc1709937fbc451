"""How a tool is laid: past walls, turned to what it is to hold, and to little else."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from anatomy.hazard_volumes import HazardVolumes
from anatomy.tissue import Label
from anatomy.wall_layers import WallKind, WallLayers
from devices.controls.fulcrum import Fulcrum
from paravol.inputs.asked_tissue import ASKED, SPARED
from paravol.inputs.tool_hold import PRESSES_N, YIELDS_MM, tool_of_shaft
from paravol.inputs.tool_plan import BITES_MM, ENTRY_MM, Pose, ToolPlan
from renderers.scene import Volume
from scenarios import tip_frame
from scenarios.instruments import INSTRUMENTS
from scenarios.instruments.contact_shape import (
    contact_table,
    placed_table,
    shaft_mm,
    works_at_mm,
)
from surgery.force import Yielding
from surgery.solids import in_capsules

H = 0.8
AXIS = (np.arange(101) - 50) * H
FULCRUM = Fulcrum(
    np.array([0.0, 0.0, 38.0]), np.array([0.0, 0.0, -1.0]), np.array([0.0, 1.0, 0.0])
)
FAR_SCOPE = np.eye(4)
FAR_SCOPE[:3, 3] = 0.0, 300.0, 0.0
UP = np.array([0.0, 1.0, 0.0])
NOW = FULCRUM.pivot_mm, 0.0
BITING = [name for name, tool in INSTRUMENTS.items() if tool.has_jaws]
BESIDE = [name for name in INSTRUMENTS if works_at_mm(name).any()]


def volume(values: NDArray[np.float64]) -> Volume:
    filled = np.ascontiguousarray(np.broadcast_to(values, (101, 101, 101)), np.float32)
    return Volume(filled, np.full(3, H), np.full(3, AXIS[0]), background=-90.0)


def across(turn: float) -> NDArray[np.float64]:
    """Return how far voxels lie along a direction of the x-y plane, mm."""
    return math.cos(turn) * AXIS + math.sin(turn) * AXIS[:, None]


def laid(plan: ToolPlan, name: str, place: NDArray[np.float64]) -> Pose:
    return plan.choose(
        name, place, FAR_SCOPE, 2.0, UP, NOW, is_at_tissue=True, beside=False
    )


def frame_of(pose: Pose, on_mm: float = 0.0) -> NDArray[np.float64]:
    """Return the shaft's frame of a pose, on_mm farther in."""
    way = pose.end_mm - pose.entry_mm
    way /= np.linalg.norm(way)
    return tip_frame(pose.end_mm + on_mm * way, way, pose.roll_deg)


@given(st.floats(-math.pi, math.pi))
@settings(max_examples=15, deadline=None)
def test_a_tool_faces_the_wall_that_is_pointed_at(turn: float) -> None:
    """However the wall stands about it: y of a tool is where it works."""
    normal = np.array([math.cos(turn), math.sin(turn), 0.0])
    plan = ToolPlan(FULCRUM, volume(across(turn) - 4.0))
    pose = laid(plan, "microdebrider", 4.0 * normal)
    # of sixteen turns one is taken
    assert frame_of(pose)[:3, 1] @ normal > math.cos(math.radians(35.0))


@pytest.mark.parametrize("name", sorted(INSTRUMENTS))
@given(st.floats(-6.0, 6.0), st.floats(-6.0, 6.0), st.floats(-20.0, 0.0))
@settings(max_examples=5, deadline=None)
def test_where_it_waits_it_presses_nothing_hard(
    name: str, x: float, y: float, z: float
) -> None:
    """Between walls, and as far as walls let it: no capsule lies deep in one."""
    air = volume(np.maximum(np.abs(across(0.3)) - 7.0, (z - AXIS)[:, None, None]))
    pose = laid(ToolPlan(FULCRUM, air), name, np.array([x, y, z]))
    if math.isinf(pose.off_mm):
        return
    tool = tool_of_shaft(name, frame_of(pose))
    table = placed_table(contact_table(name, 14 / 16), tool)
    ends = np.concatenate([table[:, :3], table[:, 3:6]])
    deep = air.sample(ends) + np.tile(table[:, 6], 2)
    assert deep[ends[:, 2] < FULCRUM.pivot_mm[2]].max() < YIELDS_MM + 0.2
    assert np.linalg.norm(pose.entry_mm - FULCRUM.pivot_mm) < ENTRY_MM + 1e-6


@pytest.mark.parametrize("name", BITING)
@given(st.floats(-math.pi, math.pi))
@settings(max_examples=8, deadline=None)
def test_jaws_hold_what_is_asked_for_and_spare_the_rest(name: str, turn: float) -> None:
    """Of a plate that is half asked for and half spared they hold the one half."""
    front = np.minimum(1.5 - np.abs(across(turn)), (-12.0 - AXIS)[:, None, None])
    aside = across(turn + math.pi / 2)
    values = np.where(aside > 0.0, ASKED, SPARED)
    labels = volume(values)
    air = volume(front)
    plan = ToolPlan(FULCRUM, air, labels.with_values(labels.values.astype(np.uint8), 0))
    along = np.array([-math.sin(turn), math.cos(turn), 0.0])
    pose = laid(plan, name, 2.0 * along + np.array([0.0, 0.0, -12.0]))
    assert pose.jaw < 1.0
    tool = tool_of_shaft(name, frame_of(pose, pose.bite_mm))
    rows = INSTRUMENTS[name].working_volume(tool, pose.jaw)
    middles = 0.5 * (rows[:, 1:4] + rows[:, 4:7])
    held = middles[air.sample(middles) > 0.0] @ along
    assert len(held)
    assert held.min() > -0.5
    assert pose.worth > 0.0


@pytest.mark.parametrize("name", BITING)
def test_who_points_at_what_is_asked_for_bites_nothing_else(name: str) -> None:
    """However much there is of other tissue beside it."""
    front = np.minimum(1.5 - np.abs(AXIS), (-12.0 - AXIS)[:, None, None])
    strip = np.where(np.abs(AXIS + 2.0)[:, None] < 0.5, ASKED, Label.MUSCLE)
    labels = volume(strip)
    labels = labels.with_values(labels.values.astype(np.uint8), 0)
    air = volume(front)
    pose = ToolPlan(FULCRUM, air, labels).choose(
        name, np.array([0.0, 0.0, -12.0]), FAR_SCOPE, 2.0, UP, NOW, is_at_tissue=True
    )
    if pose.jaw == 1.0:
        return
    tool = tool_of_shaft(name, frame_of(pose, pose.bite_mm))
    rows = INSTRUMENTS[name].working_volume(tool, pose.jaw)
    rows[:, 7] += 0.8
    matrix = labels.world_from_voxel
    asked = np.argwhere((labels.values == ASKED) & (air.values > 0.0))[:, ::-1]
    assert in_capsules(rows, asked @ matrix[:3, :3].T + matrix[:3, 3]).any()


@pytest.mark.parametrize("name", BITING)
def test_a_film_thinner_than_a_voxel_is_worth_less_than_a_whole_one(name: str) -> None:
    """A plate that fills the same voxels to an eighth, and wholly."""
    labels = volume(np.full(101, ASKED))
    labels = labels.with_values(labels.values.astype(np.uint8), 0)
    film, whole = (
        laid(
            ToolPlan(
                FULCRUM,
                volume(np.minimum(mm - np.abs(AXIS), (-12.0 - AXIS)[:, None, None])),
                labels,
            ),
            name,
            np.array([0.0, 0.0, -12.0]),
        ).worth
        for mm in (0.05, 0.4)
    )
    assert 0.0 < film < 0.5 * whole


def test_what_is_seen_only_through_other_tissue_is_worth_nothing() -> None:
    """Who points at it points at what lies before it."""
    front = volume(np.broadcast_to((-12.0 - AXIS)[:, None, None], (101,) * 3))
    eye, place = np.array([-5.55, 0.0, -9.9]), np.array([[0.45, 0.0, -13.2]])
    found = []
    for asked_from in (0.4, -50.0):
        values = np.broadcast_to(
            np.where(asked_from < AXIS, ASKED, Label.MUSCLE), (101,) * 3
        )
        labels = front.with_values(np.ascontiguousarray(values, np.uint8), 0)
        plan = ToolPlan(FULCRUM, front, labels)
        worth = plan.worth("straight forceps", place, FAR_SCOPE, 2.0, UP, eye)
        found.append(float(worth[0]))
    assert found[0] == 0.0
    assert found[1] > 0.0


@pytest.mark.parametrize("name", ["straight forceps", "backbiter", "curette"])
@given(st.floats(1.8, 2.8), st.floats(-6.5, 6.5))
@settings(max_examples=8, deadline=None)
def test_no_shaft_leans_on_what_must_not_be_hurt(name: str, x: float, y: float) -> None:
    """Its lining yields by more than it is thick."""
    side = across(0.0)
    air = volume(np.abs(side) - 3.0)
    near = air.with_values((100.0 * (3.2 - volume(side).values)).astype(np.int16), 9000)
    plan = ToolPlan(FULCRUM, air, None, HazardVolumes({"septum": near}))
    pose = laid(plan, name, np.array([x, y, 0.0]))
    if math.isinf(pose.off_mm):
        return
    table = placed_table(
        contact_table(name, 14 / 16), tool_of_shaft(name, frame_of(pose))
    )
    ends = np.concatenate([table[:, :3], table[:, 3:6]])
    gaps = 3.2 - ends[:, 0] - np.tile(table[:, 6], 2)
    assert gaps[ends[:, 2] < FULCRUM.pivot_mm[2]].min() > 0.0


@pytest.mark.parametrize(
    ("name", "hole_mm"), [("upturned forceps", 3.5), ("curved suction", 2.2)]
)
@given(st.floats(6.0, 34.0))
@settings(max_examples=12, deadline=None)
def test_no_end_passes_what_only_its_shaft_does(
    name: str, hole_mm: float, back_mm: float
) -> None:
    """Wherever a plate with a hole crosses the way to a place."""
    middle = -20.0 + back_mm
    plate = 3.0 - np.abs(AXIS - middle)[:, None, None]
    round_mm = np.hypot(AXIS, AXIS[:, None])
    air = volume(np.maximum(np.minimum(plate, round_mm - hole_mm), round_mm - 20.0))
    pose = laid(ToolPlan(FULCRUM, air), name, np.array([0.0, 0.0, -20.0]))
    if math.isinf(pose.off_mm):
        return
    table = placed_table(
        contact_table(name, 14 / 16), tool_of_shaft(name, frame_of(pose))
    )
    ends = table[:, [2, 5]].min(axis=1)
    aside = np.hypot(*table[:, 3:5].T) > hole_mm + 3.0
    assert ends[aside].min(initial=math.inf) > middle - 1.0


@pytest.mark.parametrize("name", BITING)
def test_nothing_is_bitten_beside_a_hazard(name: str) -> None:
    front = volume(np.broadcast_to((-12.0 - AXIS)[:, None, None], (101,) * 3))
    near = front.with_values((-100.0 * front.values + 50.0).astype(np.int16), 2500)
    plan = ToolPlan(FULCRUM, front, None, HazardVolumes({"artery": near}))
    pose = laid(plan, name, np.array([1.0, 2.0, -12.0]))
    assert pose.jaw == 1.0
    assert pose.worth == 0.0


@pytest.mark.parametrize("name", BITING)
@given(st.floats(-4.0, 4.0), st.floats(0.2, 1.5))
@settings(max_examples=12, deadline=None)
def test_no_bite_is_large_enough_to_pay_for_an_artery(
    name: str, aside_mm: float, radius_mm: float
) -> None:
    """However much jaws hold, no point of an artery lies between them."""
    front = volume(np.minimum(3.0 - np.abs(AXIS), (-12.0 - AXIS)[:, None, None]))
    artery = np.hypot(AXIS[:, None] - aside_mm, AXIS[:, None, None] + 14.0) - radius_mm
    near = volume(artery)
    near = near.with_values((100.0 * near.values).astype(np.int16), 2500)
    plan = ToolPlan(FULCRUM, front, None, HazardVolumes({"artery": near}))
    pose = laid(plan, name, np.array([0.0, 0.0, -12.0]))
    if pose.jaw == 1.0:
        return
    tool = tool_of_shaft(name, frame_of(pose, pose.bite_mm))
    rows = INSTRUMENTS[name].working_volume(tool, pose.jaw)
    low = np.minimum(rows[:, 1:4], rows[:, 4:7]).min(axis=0) - rows[:, 7].max()
    high = np.maximum(rows[:, 1:4], rows[:, 4:7]).max(axis=0) + rows[:, 7].max()
    axes = [np.arange(a, b, 0.25) for a, b in zip(low, high, strict=True)]
    places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    held = places[in_capsules(rows, places)]
    apart = np.hypot(held[:, 1] - aside_mm, held[:, 2] + 14.0) - radius_mm
    assert apart.min() > -0.1


def test_a_scope_in_the_way_is_passed() -> None:
    """Its last eight millimetres touch no shaft."""
    front = volume(np.broadcast_to((-25.0 - AXIS)[:, None, None], (101,) * 3))
    plan = ToolPlan(FULCRUM, front)
    for x in np.linspace(-8.0, 8.0, 9):
        scope = np.eye(4)
        pose = plan.choose(
            "suction tube",
            np.array([x, 0.0, -25.0]),
            scope,
            2.0,
            UP,
            NOW,
            is_at_tissue=True,
        )
        way = pose.end_mm - pose.entry_mm
        shaft = pose.entry_mm + np.linspace(0.0, 1.0, 400)[:, None] * way
        near = shaft[(shaft[:, 2] > 0.0) & (shaft[:, 2] < 8.0)]
        assert np.linalg.norm(near[:, :2], axis=1).min() > 2.0 + 0.5


@pytest.mark.parametrize("name", BESIDE)
def test_what_works_beside_its_shaft_bites_there(name: str) -> None:
    place = works_at_mm(name)
    assert place[0] == 0.0
    assert place[1] > float(np.abs(shaft_mm(name)[:2]).max())
    rows = INSTRUMENTS[name].working_volume(np.eye(4), 0.25)
    ends = rows[:, 1:7].reshape(-1, 3)
    assert (ends.min(axis=0) <= place + 1e-9).all()
    assert (place <= ends.max(axis=0) + 1e-9).all()


def test_what_is_pointed_at_is_bitten_where_nothing_is_asked_for() -> None:
    front = volume(np.broadcast_to((-12.0 - AXIS)[:, None, None], (101,) * 3))
    labels = front.with_values(np.full((101,) * 3, Label.UNCINATE, np.uint8), 0)
    pose = laid(
        ToolPlan(FULCRUM, front, labels), "straight forceps", np.array([2.0, 0, -12.0])
    )
    assert pose.jaw < 1.0
    assert pose.bite_mm <= 6.0 - BITES_MM.min()


FREE_AIR = volume(np.full((101, 101, 101), -90.0))
SHAFT_MM = 1.6
"""Radius of the forceps' shaft; their closed jaws are hardly wider."""


def layers_of(kind: WallKind, ground: Label) -> WallLayers:
    none = WallKind("", 0.0, 0.0, Label.MUCOSA, Label.MUCOSA)
    row = FREE_AIR.with_values(np.full((101,) * 3, 1, np.uint8), 0)
    below = FREE_AIR.with_values(np.full((101,) * 3, ground, np.uint8), 0)
    return WallLayers(row, below, (none, kind))


@pytest.mark.parametrize("lacks_mm", [0.05, 0.7])
def test_a_tool_presses_between_soft_walls_and_not_between_hard_ones(
    lacks_mm: float,
) -> None:
    """A slit that is too narrow on either side, and a place behind it."""
    half = SHAFT_MM - lacks_mm
    slit = np.minimum(np.abs(AXIS) - half, (8.0 - np.abs(AXIS - 4.0))[:, None, None])
    front = np.maximum(slit, (-20.0 - AXIS)[:, None, None])
    reached = {}
    for kind, ground in (
        (WallKind("", 2.0, 0.0, Label.MUCOSA, Label.MUCOSA), Label.MIDDLE_TURBINATE),
        (WallKind("bone", 0.3, 2.0, Label.MUCOSA, Label.THICK_BONE), Label.FAT),
    ):
        layers = layers_of(kind, ground)
        plan = ToolPlan(FULCRUM, volume(front), None, None, layers)
        pose = plan.choose(
            "straight forceps",
            np.array([0.0, 0.0, -19.0]),
            FAR_SCOPE,
            2.0,
            UP,
            NOW,
            is_at_tissue=False,
        )
        reached[ground] = pose.off_mm < 2.0
        yields_mm = Yielding(layers, PRESSES_N).at(np.zeros((1, 3)))[0]
        assert reached[ground] == (lacks_mm < yields_mm)
    assert reached[Label.MIDDLE_TURBINATE]
    assert reached[Label.FAT] == (lacks_mm < 0.3)


def test_a_window_turns_to_what_is_asked_for_and_away_from_what_is_spared() -> None:
    """Between two walls of a slit, of which one is asked for."""
    slit = volume(np.maximum(np.abs(AXIS) - 3.0, (-22.0 - AXIS)[:, None, None]))
    for side in (1.0, -1.0):
        labels = slit.with_values(
            volume(np.where(side * AXIS > 0.0, ASKED, SPARED)).values.astype(np.uint8),
            0,
        )
        plan = ToolPlan(FULCRUM, slit, labels)
        pose = laid(plan, "microdebrider", np.array([side * 3.0, 0.0, -14.0]))
        assert pose.worth > 0.0
        assert side * frame_of(pose)[0, 1] > 0.8


def test_ways_are_told_where_there_are_some_and_end_at_their_places() -> None:
    front = volume(np.broadcast_to((-12.0 - AXIS)[:, None, None], (101,) * 3))
    labels = front.with_values(np.full((101,) * 3, Label.UNCINATE, np.uint8), 0)
    places = np.array([[2.0, 0.0, -13.0], [0.0, 60.0, -13.0], [-3.0, 1.0, -12.5]])
    of, entries, ends, worth = ToolPlan(FULCRUM, front, labels).lines(
        "straight forceps", places
    )
    assert set(of) == {0, 2}
    assert (worth > 0.0).all()
    away = np.linalg.norm((ends - places[of])[:, :2], axis=1)
    assert away.max() < 1.0
    off = np.linalg.norm(entries - FULCRUM.pivot_mm, axis=1)
    assert off.max() < ENTRY_MM + 1e-6
