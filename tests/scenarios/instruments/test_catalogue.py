"""Laws of tools: what is seen, felt and cut is one and the same shape."""

import numpy as np
import pytest
import pyvista as pv
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from anatomy.tissue import TISSUES
from renderers.scene import Mesh
from scenarios import tip_frame
from scenarios.instrument_state import NO_TOOL
from scenarios.instruments import (
    INSTRUMENTS,
    MARGIN_MM,
    Action,
    Capsules,
    Instrument,
    instrument_named,
    placed_tool,
)
from scenarios.instruments.catalogue import parts_of
from scenarios.instruments.forceps import Forceps
from scenarios.instruments.parts import moved
from surgery.kernels.solid_distance import solids_distance
from surgery.solids import Rows
from system import UserError

Doubles = NDArray[np.float64]

tools = pytest.mark.parametrize("tool", INSTRUMENTS.values(), ids=list(INSTRUMENTS))
with_jaws = pytest.mark.parametrize(
    "tool",
    [t for t in INSTRUMENTS.values() if t.action is Action.BITE],
    ids=lambda t: t.name,
)
sweeping = pytest.mark.parametrize(
    "tool",
    [t for t in INSTRUMENTS.values() if len(t.shape.edge()[0])],
    ids=lambda t: t.name,
)


def outside(capsules: Capsules, points: Doubles) -> Doubles:
    """Return how far points lie outside capsules, mm; negative within."""
    axis = capsules.end_mm - capsules.start_mm
    off = points[:, None] - capsules.start_mm
    along = (off * axis).sum(axis=2) / np.maximum((axis**2).sum(axis=1), 1e-12)
    nearest = np.clip(along, 0.0, 1.0)[..., None] * axis
    apart = np.linalg.norm(off - nearest, axis=2) - capsules.radius_mm
    result: Doubles = apart.min(axis=1)
    return result


def on_capsules(capsules: Capsules, count: int, seed: int) -> Doubles:
    """Return points on the outside of the union of capsules."""
    chance = np.random.default_rng(seed)
    which = chance.integers(len(capsules.radius_mm), size=count)
    away = chance.normal(size=(count, 3))
    away /= np.linalg.norm(away, axis=1, keepdims=True)
    start, end = capsules.start_mm[which], capsules.end_mm[which]
    points = start + chance.random((count, 1)) * (end - start)
    points = points + capsules.radius_mm[which, None] * away
    return points[outside(capsules, points) > -1e-6]


def on_mesh(mesh: Mesh, count: int, seed: int) -> Doubles:
    """Return points spread over a mesh's surface."""
    body = trimesh.Trimesh(mesh.vertices, mesh.faces)
    return np.asarray(trimesh.sample.sample_surface(body, count, seed=seed)[0])


def mesh_distance(mesh: Mesh, points: Doubles) -> Doubles:
    """Return points' signed distance from a mesh's solids, negative inside one."""
    found = []
    for body in trimesh.Trimesh(mesh.vertices, mesh.faces).split():
        surface = pv.PolyData.from_regular_faces(body.vertices, body.faces)
        cloud = pv.PolyData(points).compute_implicit_distance(surface)
        found.append(np.asarray(cloud["implicit_distance"]))
    result: Doubles = np.min(found, axis=0)
    return result


def distances(points: Doubles, rows: Rows) -> Doubles:
    return np.array([solids_distance(x, y, z, rows) for x, y, z in points.tolist()])


def within(rows: Rows, count: int, seed: int) -> Doubles:
    """Return points inside capsules and blades: on their axes, and away from them."""
    chance = np.random.default_rng(seed)
    picked = rows[chance.integers(len(rows), size=count)]
    share = chance.random((count, 1))
    away = chance.normal(size=(count, 3))
    away *= chance.random((count, 1)) / np.linalg.norm(away, axis=1, keepdims=True)
    ends = picked[:, 1:7].reshape(-1, 2, 3)
    radius = np.where(picked[:, 0] == 0.0, picked[:, 7], picked[:, 13])
    return ends[:, 0] + share * (ends[:, 1] - ends[:, 0]) + away * radius[:, None]


def a_pose(seed: int) -> Doubles:
    pose = np.eye(4)
    pose[:3, :3] = Rotation.random(random_state=seed).as_matrix()
    pose[:3, 3] = np.random.default_rng(seed).uniform(-80, 80, 3)
    return pose


@tools
def test_every_part_is_a_closed_solid(tool: Instrument) -> None:
    for part in parts_of(tool):
        body = trimesh.Trimesh(part.mesh.vertices, part.mesh.faces)
        assert body.is_watertight
        assert body.is_winding_consistent
        assert all(piece.volume > 0 for piece in body.split())


@tools
def test_no_part_sticks_out_of_its_capsules(tool: Instrument) -> None:
    for part in parts_of(tool):
        # the handle's end is outside the patient
        points = on_mesh(part.mesh, 3000, 1)
        points = points[points[:, 2] < 110.0]
        assert outside(part.capsules, points).max() <= MARGIN_MM


@tools
def test_no_capsule_sticks_out_of_its_part(tool: Instrument) -> None:
    """But over the window of a debrider, which tissue only fills when it is sucked."""
    for part in parts_of(tool):
        points = on_capsules(part.capsules, 3000, 2)
        if tool.action is Action.POWERED:
            points = points[points[:, 1] < 1.0]
        assert mesh_distance(part.mesh, points).max() <= 0.5


@tools
def test_capsules_are_solids_too(tool: Instrument) -> None:
    capsules = tool.capsules(a_pose(3), 0.4)
    points = moved(np.random.default_rng(3).uniform(-9, 9, (60, 3)), a_pose(3))
    np.testing.assert_allclose(
        distances(points, capsules.rows()), outside(capsules, points), atol=1e-9
    )
    assert len(capsules.rows()) <= 45


@tools
def test_few_capsules_cast_the_shadow_that_the_tool_casts(tool: Instrument) -> None:
    """Seen from its side a tool covers what they cover, but for half a millimetre."""
    for part in parts_of(tool):
        spine = part.mesh.spine(np.eye(4))
        assert len(spine.radius_mm) <= 9
        caster = Capsules(spine.start_mm, spine.end_mm, spine.radius_mm)
        points = on_mesh(part.mesh, 2000, 6)
        points = points[points[:, 2] < 100.0]
        assert np.percentile(outside(caster, points), 90) < 0.35
        assert mesh_distance(part.mesh, on_capsules(caster, 2000, 7)).max() < 1.6


@tools
def test_the_tip_is_at_the_origin_and_the_shaft_runs_up(tool: Instrument) -> None:
    mesh = tool.mesh(1.0)
    # a ring has its first point beside the middle of a fan: none is farther than .5 mm
    assert np.linalg.norm(mesh.vertices, axis=1).min() <= 1.3
    assert mesh.vertices[:, 2].max() > 100.0
    assert mesh.vertices[:, 2].min() > -1.5
    middle, radius = tool.tip_ball(np.eye(4))
    assert outside(tool.capsules(np.eye(4), 1.0), middle[None])[0] < MARGIN_MM
    assert 0.0 < radius <= np.linalg.norm(middle) + 0.5


@with_jaws
@settings(max_examples=20, deadline=None)
@given(first=st.floats(0.0, 1.0), second=st.floats(0.0, 1.0))
def test_jaws_move_as_far_as_they_are_told(
    tool: Instrument, first: float, second: float
) -> None:
    turn = abs(first - second)
    for part in parts_of(tool):
        start, end = (
            moved(part.mesh.vertices, part.pose(jaw)) for jaw in (first, second)
        )
        reach = np.hypot(
            part.mesh.vertices[:, 1] - part.hinge_mm[0],
            part.mesh.vertices[:, 2] - part.hinge_mm[1],
        )
        angle = np.radians(abs(part.open_deg)) * turn
        chord = 2 * reach * np.sin(angle / 2)
        np.testing.assert_allclose(
            np.linalg.norm(end - start, axis=1), chord, atol=1e-9
        )
        np.testing.assert_allclose(part.pose(1.0), np.eye(4), atol=1e-15)


@pytest.mark.parametrize("jaw", [0.0, 0.3, 0.8, 1.0])
def test_the_jaws_of_forceps_never_pass_through_each_other(jaw: float) -> None:
    _, up, low = instrument_named("straight forceps").placed(np.eye(4), jaw)
    above = moved(up[0].vertices, up[1])
    below = moved(low[0].vertices, low[1])
    np.testing.assert_allclose(np.sort(above[:, 1]), np.sort(-below[:, 1]), atol=1e-9)
    # before the hinge each stays on its side
    cups = above[above[:, 2] < 9.0]
    assert cups[:, 1].min() >= 0.0


def test_a_bite_of_closed_forceps_is_what_the_cups_hold() -> None:
    """The hull of both cups, the window's corners left out, within half a wall."""
    for name in ("straight forceps", "upturned forceps"):
        tool = instrument_named(name)
        shape = tool.shape
        assert isinstance(shape, Forceps)
        jaws = np.concatenate([part.mesh.vertices for part in parts_of(tool)[1:]])
        cups = jaws[np.linalg.norm(jaws - shape.line().at(3.5), axis=1) < 3.9]
        hull = ConvexHull(cups)
        chance = np.random.default_rng(3)
        corners = cups[hull.simplices[chance.integers(len(hull.simplices), size=800)]]
        weight = chance.dirichlet([1, 1, 1], size=800)
        surface = (corners * weight[..., None]).sum(axis=1)
        found = distances(surface, tool.working_volume(np.eye(4), 1.0))
        assert np.abs(found).max() < 0.55
        assert np.abs(found).mean() < 0.2


def test_wider_jaws_take_more() -> None:
    chance = np.random.default_rng(5)
    points = chance.uniform([-4, -8, -3], [4, 12, 14], (4000, 3))
    for tool in INSTRUMENTS.values():
        if tool.action is Action.BITE:
            taken = [
                (distances(points, rows) < 0).sum() if len(rows) else 0
                for rows in (tool.working_volume(np.eye(4), j) for j in (1.0, 0.5, 0.0))
            ]
            assert taken[0] < taken[1] < taken[2]


@tools
@pytest.mark.parametrize("jaw", [0.0, 0.6, 1.0])
def test_a_tool_takes_what_is_near_its_tip_and_not_within_its_shaft(
    tool: Instrument, jaw: float
) -> None:
    rows = tool.working_volume(np.eye(4), jaw)
    if not len(rows):
        assert (
            tool.action in (Action.FEEL, Action.SUCK, Action.INJECT)
            or tool.name == "backbiter"
        )
        return
    points = within(rows, 3000, 4)
    assert np.linalg.norm(points, axis=1).max() < 14.0
    assert distances(points, rows).max() < 1e-9
    if tool.action in (Action.BITE, Action.POWERED):
        # tools without a working end of its own cut with the shaft itself
        assert outside(parts_of(tool)[0].capsules, points).min() > -0.15


@tools
@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 10_000), jaw=st.floats(0.0, 1.0))
def test_everything_moves_with_the_tool(
    tool: Instrument, seed: int, jaw: float
) -> None:
    pose = a_pose(seed)
    points = np.random.default_rng(seed).uniform(-10, 10, (30, 3))
    for here, there in (
        (tool.working_volume(np.eye(4), jaw), tool.working_volume(pose, jaw)),
    ):
        np.testing.assert_allclose(
            distances(points, here), distances(moved(points, pose), there), atol=1e-9
        )
    np.testing.assert_allclose(
        outside(tool.capsules(np.eye(4), jaw), points),
        outside(tool.capsules(pose, jaw), moved(points, pose)),
        atol=1e-9,
    )
    for (mesh, first), (same, second) in zip(
        tool.placed(np.eye(4), jaw), tool.placed(pose, jaw), strict=True
    ):
        assert mesh is same
        np.testing.assert_allclose(pose @ first, second, atol=1e-9)


@sweeping
@settings(max_examples=15, deadline=None)
@given(
    seed=st.integers(0, 10_000),
    way=st.tuples(*[st.floats(-3.0, 3.0)] * 3),
    cut=st.floats(0.1, 0.9),
)
def test_parts_of_a_way_take_what_the_whole_takes(
    tool: Instrument, seed: int, way: tuple[float, float, float], cut: float
) -> None:
    begin = a_pose(seed)
    middle, end = begin.copy(), begin.copy()
    middle[:3, 3] += cut * np.array(way)
    end[:3, 3] += way
    points = moved(np.random.default_rng(seed).uniform(-6, 6, (40, 3)), begin)
    whole = distances(points, tool.working_volume(end, before=begin))
    halves = np.minimum(
        distances(points, tool.working_volume(middle, before=begin)),
        distances(points, tool.working_volume(end, before=middle)),
    )
    np.testing.assert_allclose(whole, halves, atol=1e-6)
    rest = distances(points, tool.working_volume(begin))
    assert (whole <= rest + 1e-6).all()


def test_forces_tell_lamellae_from_the_skull_base() -> None:
    lamella = TISSUES["lamina papyracea"].fracture_n
    roof = TISSUES["skull base"].fracture_n
    breaks = {
        name: (tool.taker.force_n > lamella, tool.taker.force_n > roof)
        for name, tool in INSTRUMENTS.items()
    }
    assert breaks["straight forceps"] == breaks["upturned forceps"] == (True, False)
    assert breaks["through-cutting punch"] == (True, False)
    assert breaks["backbiter"] == breaks["curette"] == (True, True)
    for harmless in ("ball probe", "suction tube", "curved suction", "microdebrider"):
        assert breaks[harmless] == (False, False)


def test_only_the_debrider_needs_suction() -> None:
    assert [t.name for t in INSTRUMENTS.values() if t.needs_suction] == [
        "microdebrider"
    ]
    assert instrument_named("microdebrider").suction_ml_s > 0


def test_an_unknown_name_is_told_with_those_there_are() -> None:
    for ask in (
        lambda: instrument_named("chisel"),
        lambda: placed_tool("chisel", np.eye(4), 1.0),
    ):
        with pytest.raises(UserError, match="no instrument 'chisel'; there are: suct"):
            ask()
    assert placed_tool(NO_TOOL, np.eye(4), 1.0) == []


def test_an_upright_tool_opens_upwards_and_rolls_to_the_right() -> None:
    """As the light post does: right-handed about where the tool points."""
    ahead = np.array([0.0, 1.0, 0.0])
    upright = tip_frame(np.zeros(3), ahead)
    np.testing.assert_allclose(upright[:3, 1], [0, 0, 1], atol=1e-12)
    rolled = tip_frame(np.zeros(3), ahead, 90.0)
    turn = Rotation.from_rotvec(np.radians(90.0) * ahead).as_matrix()
    np.testing.assert_allclose(rolled[:3, :3], turn @ upright[:3, :3], atol=1e-12)


@tools
def test_what_tissue_gives_way_to_is_the_tool(tool: Instrument) -> None:
    """From the ball at its end on, and within what contact takes it for."""
    pose = tip_frame(np.array([1.0, 2.0, 3.0]), np.array([0.3, 0.2, 1.0]), 0.4)
    end = tool.end(pose, 9.0)
    middle, radius = tool.tip_ball(pose)
    np.testing.assert_allclose(end.start_mm[0], middle, atol=1e-9)
    assert end.radius_mm[0] == pytest.approx(radius)
    assert 1 <= len(end.radius_mm) <= 2
    np.testing.assert_allclose(end.start_mm[1:], end.end_mm[:-1], atol=1e-9)
    share = np.linspace(0.0, 1.0, 20)[:, None, None]
    axis = end.start_mm + share * (end.end_mm - end.start_mm)
    length = np.linalg.norm(end.end_mm - end.start_mm, axis=1).sum()
    assert length == pytest.approx(9.0, abs=0.4)
    apart = outside(tool.capsules(pose, 1.0), axis.reshape(-1, 3))
    if tool.name not in ("curette", "backbiter"):
        # a ring and a hook are open, and are taken for a full end, as cups are
        assert apart.max() < 0.75
