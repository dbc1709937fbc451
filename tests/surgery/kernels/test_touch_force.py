"""One tick of force against closed forms, laws of contact and bad input."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from surgery.kernels import touch_force as tick
from tests.surgery.one_wall import H, Tick, ball, floor, groove, patch_of, sheet

HEIGHT = 1.0
"""Of the ball's middle where it just touches the floor."""


def line(begin: list[float], end: list[float], steps: int) -> np.ndarray:
    return np.linspace(begin, end, steps)


@given(depth=st.floats(0.01, 2.0), soft=st.floats(0.05, 20.0))
@settings(deadline=None, max_examples=40)
def test_a_flat_wall_is_hookes_spring(depth: float, soft: float) -> None:
    tool = Tick(floor(), soft=soft)
    tool.at([0, 0, 3])
    force = tool.at([0, 0, HEIGHT - depth])
    assert force == pytest.approx([0, 0, soft * depth], rel=2e-3)
    assert tool.out[tick.DEPTH] == pytest.approx(depth, rel=2e-3)


def test_free_space_is_exactly_without_force() -> None:
    tool = Tick(ball())
    rng = np.random.default_rng(3)
    for _ in range(300):
        way = rng.normal(size=3)
        force = tool.at(way / np.linalg.norm(way) * rng.uniform(7.3, 10.0))
        if not tool.flags & tick.TOUCHING:
            assert not force.any()
    far = Tick(floor())
    assert not far.along(line([0, 0, 3], [5, 5, 1.2], 50)).any()


def test_force_on_a_sphere_has_no_jumps_and_points_outwards() -> None:
    """Spheres of 12 voxels, 0.5 mm deep, in steps of 2 um: figures of the design."""
    tool = Tick(ball())
    radius = 12 * H + 1.0 - 0.5
    tool.along(line([0, 0, 8], [0, 0, radius], 60))
    angles = np.arange(0, 0.35, 2e-3 / radius)
    out = np.stack([np.sin(angles), 0 * angles, np.cos(angles)], axis=1)
    forces = tool.along(radius * out)
    assert np.abs(np.diff(np.linalg.norm(forces, axis=1))).max() < 5e-3
    assert np.linalg.norm(np.diff(forces, axis=0), axis=1).max() < 5e-4
    size = np.linalg.norm(forces, axis=1)
    assert size == pytest.approx(np.full(len(size), 0.25), rel=0.03)
    cosine = np.einsum("ij,ij->i", forces, out) / size
    assert np.degrees(np.arccos(np.clip(cosine, -1, 1))).max() < 0.2


def test_walls_side_by_side_are_felt_without_a_step() -> None:
    """A soft and a hard wall meet at x = 0; 2 um steps across at 0.5 mm depth."""
    patch = floor()
    rows = patch.wall.copy()
    rows[:, :, : rows.shape[2] // 2] = 2
    tool = Tick(patch._replace(wall=rows), mucosa_mm=1.0)
    tool.walls[2, tick.SOFT] = 1.5
    tool.at([-1, 0, 3])
    places = np.zeros((1000, 3))
    places[:, 0] = np.arange(1000) * 2e-3 - 1.0
    places[:, 2] = HEIGHT - 0.5
    size = np.linalg.norm(tool.along(places), axis=1)
    assert size[0] == pytest.approx(0.75, rel=0.01)
    assert size[-1] == pytest.approx(0.25, rel=0.01)
    assert np.abs(np.diff(size)).max() < 5e-3


def test_the_proxy_stays_out_while_it_slides() -> None:
    tool = Tick(ball(), friction=0.2)
    rng = np.random.default_rng(5)
    place = np.array([0.0, 0.0, 8.0])
    aim = place
    for n in range(4000):
        if n % 200 == 0:
            aim = rng.normal(size=3)
            aim *= rng.uniform(5.0, 7.5) / np.linalg.norm(aim)
        place = place + np.clip(aim - place, -0.03, 0.03)
        tool.at(place)
        gap = np.linalg.norm(tool.proxy()) - 12 * H - 1.0
        # a twentieth of a voxel; trilinear spheres are a hundredth smaller
        assert gap > -0.05 * H - 0.01


@pytest.mark.parametrize("half_deg", [25.0, 35.0, 45.0, 70.0])
def test_two_walls_hold_a_tool_at_once(half_deg: float) -> None:
    """In a groove two balls rest on a wall each, and the force points out of it."""
    half = np.radians(half_deg)
    tool = Tick(groove(half_deg), balls=np.array([[-2.0, 0, 0, 1], [2.0, 0, 0, 1]]))
    rest = (1.0 + 2.0 * np.cos(half)) / np.sin(half)
    tool.at([0, 0, rest + 1])
    tool.along(line([0, 0, rest + 1], [0, 0, rest - 0.4], 40))
    for aside in (0.0, 0.3):
        force = tool.at([aside, 0, rest - 0.4])
        assert tool.out[tick.PASSES] < tick.MOST_PASSES
        # on one wall alone where that is nearer to the hand
        slope = 1.0 / np.tan(half)
        x = max(0.0, (aside - 0.4 * slope) / (1.0 + slope**2))
        there = np.array([x, 0, rest + slope * x])
        assert tool.proxy() == pytest.approx(there, abs=0.05 * H)
        wanted = 0.5 * (there - [aside, 0, rest - 0.4])
        assert force == pytest.approx(wanted, abs=0.01)


@pytest.mark.parametrize("half_deg", [15.0, 30.0, 45.0, 70.0])
def test_a_ball_settles_between_two_walls(half_deg: float) -> None:
    """On the ridge of the field, which interpolation cuts off by half a voxel."""
    tool = Tick(groove(half_deg))
    half = np.radians(half_deg)
    exact = 1.0 / np.sin(half)
    least = 0.5 * H * np.cos(half) / np.sin(half)
    tool.at([0, 0, exact + 2])
    tool.along(line([0, 0, exact + 2], [0, 0, exact - 0.4], 40))
    assert tool.out[tick.PASSES] < tick.MOST_PASSES
    x, y, z = tool.proxy()
    assert abs(x) < 0.01
    assert y == 0.0
    assert exact - 0.01 < z < exact + least + 0.01


@given(share=st.floats(0.1, 3.0), friction=st.floats(0.05, 0.5))
@settings(deadline=None, max_examples=40)
def test_friction_is_coulombs(share: float, friction: float) -> None:
    """A hand that moves aside by `share` cones is held, or slides with the cone."""
    tool = Tick(floor(), friction=friction)
    tool.at([0, 0, 3])
    tool.along(line([0, 0, 3], [0, 0, HEIGHT - 1.0], 30))
    aside = share * friction
    force = tool.along(line([0, 0, HEIGHT - 1.0], [aside, 0, HEIGHT - 1.0], 20))[-1]
    assert -force[0] == pytest.approx(0.5 * min(aside, friction), rel=5e-3)
    assert force[2] == pytest.approx(0.5, rel=5e-3)


def test_a_push_that_is_taken_back_leaves_no_trace() -> None:
    tool = Tick(ball(), mucosa_mm=1.0, bone_mm=1.0, soft=0.3, hard=3.0)
    down = line([0, 0, 7.5], [0, 0, 6.0], 400)
    there = tool.along(down)[:, 2]
    back = tool.along(down[::-1])[::-1, 2]
    # an eleventh of the way from the wall on: relative to what there is to feel
    assert back == pytest.approx(there, rel=0.01, abs=1e-3)
    assert there.max() > 1.0


def test_mucosa_is_pressed_together_before_bone_is_felt() -> None:
    tool = Tick(floor(), mucosa_mm=1.0, bone_mm=2.0, soft=0.3, hard=3.0)
    tool.at([0, 0, 3])
    give = tick.PRESSED * 1.0
    for depth in (0.3, 0.6, 0.9, 1.4):
        force = tool.at([0, 0, HEIGHT - depth])[2]
        wanted = 0.3 * min(depth, give) + 3.0 * max(depth - give, 0.0)
        assert force == pytest.approx(wanted, rel=0.01)


def test_bare_bone_feels_hard_at_once() -> None:
    """Mucosa that was taken away: the surface lies at its depth of before."""
    patch = floor()
    before = patch._replace(pristine=patch.pristine + np.float32(1.0))
    tool = Tick(before, mucosa_mm=1.0, bone_mm=2.0, soft=0.3, hard=3.0)
    tool.at([0, 0, 3])
    assert tool.at([0, 0, HEIGHT - 0.5])[2] == pytest.approx(1.5, rel=0.01)


def test_a_thin_wall_holds_until_it_breaks_and_then_lets_through() -> None:
    """One voxel thick, 5 mm/s: its side is kept until the force is too large."""
    tool = Tick(sheet(), bone_mm=H, hard=3.0, soft=3.0, break_n=4.0)
    bears = 4.0 * tick.scatter_of(1, 0.0, 0.0, HEIGHT + H / 2)
    tool.at([0, 0, 4])
    for z in np.arange(4.0, -4.0, -5e-3):
        force = tool.at([0, 0, z])[2]
        if tool.state[tick.BROKEN] == 0:
            assert tool.proxy()[2] > HEIGHT + H / 2 - 0.05 * H
            assert force <= bears * 1.01
            greatest = force
        else:
            break
    assert greatest == pytest.approx(bears, rel=0.02)
    assert tool.out[tick.BROKE] == 1
    assert z > -2.0
    # through the hole, to and fro, without a wall
    assert not tool.along(line([0, 0, z], [0, 0, -4], 300))[5:].any()
    assert not tool.along(line([0, 0, -4], [0, 0, 4], 300)).any()
    # beside the hole the wall still holds
    tool.along(line([0, 0, 4], [6, 0, 4], 50))
    assert tool.along(line([6, 0, 4], [6, 0, 0.8], 100))[-1, 2] > 1.0


def test_a_wall_without_a_breaking_force_never_breaks() -> None:
    tool = Tick(sheet(), bone_mm=H, hard=3.0, break_n=0.0)
    tool.along(line([0, 0, 4], [0, 0, -6], 500))
    assert tool.state[tick.BROKEN] == 0
    assert tool.proxy()[2] > HEIGHT


def test_breaking_forces_scatter_by_place_alone() -> None:
    rng = np.random.default_rng(8)
    places = rng.uniform(-40, 40, (4000, 3))
    found = np.array([tick.scatter_of(3, *place) for place in places])
    assert found.min() >= 1 - tick.SCATTER
    assert found.max() <= 1 + tick.SCATTER
    assert found.mean() == pytest.approx(1.0, abs=0.02)
    assert found.std() == pytest.approx(tick.SCATTER / np.sqrt(3), rel=0.05)
    again = [tick.scatter_of(3, *place) for place in places[:50]]
    assert again == found[:50].tolist()
    assert tick.scatter_of(4, *places[0]) != found[0]


def test_a_force_too_large_keeps_its_direction() -> None:
    free, bound = Tick(groove(45.0)), Tick(groove(45.0), most_n=0.1)
    for tool in (free, bound):
        tool.at([0, 0, 3])
        tool.at([0.4, 0, 0.6])
    whole, clipped = (tool.out[:6] for tool in (free, bound))
    assert np.linalg.norm(clipped[:3]) == pytest.approx(0.1)
    assert clipped * np.linalg.norm(whole[:3]) / 0.1 == pytest.approx(whole)
    assert bound.flags & tick.CLIPPED
    assert not free.flags & tick.CLIPPED
    assert bound.out[tick.TISSUE_N] == pytest.approx(free.out[tick.TISSUE_N])


def test_a_device_is_told_no_steeper_wall_than_it_bears() -> None:
    tool = Tick(floor(), soft=20.0, stiffest=0.5)
    tool.at([0, 0, 3])
    assert tool.at([0, 0, HEIGHT - 0.4])[2] == pytest.approx(0.2, rel=5e-3)
    assert tool.out[tick.TISSUE_N] == pytest.approx(8.0, rel=5e-3)
    assert tool.out[tick.SLOPE] == 0.5


def test_a_late_tick_is_softer_and_stiffness_comes_back() -> None:
    tool = Tick(floor())
    tool.along(line([0, 0, 3], [0, 0, HEIGHT - 0.4], 100))
    late = tool.at([0, 0, HEIGHT - 0.4], dt=5e-3)[2]
    assert late == pytest.approx(0.2 / 5, rel=0.01)
    assert tool.flags & tick.LATE
    after = tool.along(np.tile([0, 0, HEIGHT - 0.4], (30, 1)))[:, 2]
    assert np.all(np.diff(after) >= -1e-6)
    assert after[0] < 0.07
    assert after[-1] == pytest.approx(0.2, rel=0.01)


def test_torque_is_the_forces_arm() -> None:
    """A ball 10 mm up a tool that lies along x touches the floor."""
    tool = Tick(floor(), balls=np.array([[10.0, 0, 0, 1.0], [0, 0, 4.0, 1.0]]))
    tool.at([-5, 0, 3])
    force = tool.at([-5, 0, HEIGHT - 0.5])
    torque = tool.out[tick.TORQUE : tick.TORQUE + 3]
    assert force == pytest.approx([0, 0, 0.25], rel=5e-3)
    assert torque == pytest.approx(np.cross([10, 0, -1.0], force), rel=0.01)


def test_suction_pulls_towards_near_tissue_only() -> None:
    tool = Tick(floor(), pull_n=0.06)
    assert not tool.at([0, 0, HEIGHT + tick.PULL_MM + 0.01]).any()
    near = tool.along(line([0, 0, HEIGHT + 1], [0, 0, HEIGHT + 0.01], 50))[:, 2]
    assert np.all(np.diff(near) < 1e-9)
    assert near[-1] == pytest.approx(-0.06 * 0.99**2, rel=0.01)


def test_damping_takes_no_more_than_half_of_what_is_left() -> None:
    """At a speed that the filter has settled to, B is the bound's half, not 1."""
    device, speed = 5e-4, 20.0
    tool = Tick(floor(), damping=device, viscous=1.0, stiffest=0.3)
    dry = Tick(floor(), damping=device, viscous=0.0, stiffest=0.3)
    bound = 0.5 * (device - 0.3 * 1e-3 / 2)
    places = np.zeros((60, 3))
    places[:, 2] = HEIGHT + 0.1 - speed * 1e-3 * np.arange(60)
    spring = dry.along(places)[:, 2]
    forces = tool.along(places)[:, 2]
    assert (forces - spring)[40:] == pytest.approx(bound * speed, rel=0.02)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_a_pose_that_is_none_gives_no_force(bad: float) -> None:
    tool = Tick(floor())
    tool.at([0, 0, 3])
    assert tool.at([0, 0, 0.5]).any()
    for k in range(3):
        place = np.array([0.0, 0.0, 0.5])
        place[k] = bad
        assert not tool.at(place).any()
        assert tool.flags == tick.FAULT
    assert not tool.at([0, 0, 0.5], dt=bad).any()
    assert not tool.at([0, 0, 0.5], dt=0.0).any()
    assert np.isfinite(tool.at([0, 0, 2.0])).all()
    assert tool.at([0, 0, 0.5])[2] == pytest.approx(0.25, rel=0.01)


def test_a_tool_that_begins_deep_in_tissue_is_told_nothing_until_it_is_out() -> None:
    tool = Tick(floor())
    assert not tool.along(line([0, 0, -4], [0, 0, -0.5], 20)).any()
    assert tool.flags & tick.BURIED
    tool.along(line([0, 0, -0.5], [0, 0, 2], 50))
    assert tool.at([0, 0, 0.5])[2] == pytest.approx(0.25, rel=0.01)


def test_off_the_patch_all_is_air() -> None:
    tool = Tick(floor())
    assert not tool.along(line([60, 0, -30], [80, 0, -40], 20)).any()


def test_a_passage_too_narrow_squeezes_without_noise() -> None:
    """2 mm of air hold a ball of 1.2 mm radius: small, bounded, steady."""
    from tests.surgery.one_wall import axes

    _, _, z = axes()
    tool = Tick(patch_of(np.abs(z) - 1.0), balls=np.array([[0, 0, 0, 1.2]]))
    places = np.zeros((300, 3))
    places[:, 0] = np.linspace(-5, 5, 300)
    forces = np.linalg.norm(tool.along(places), axis=1)
    assert forces.max() < 0.5 * 0.4
    assert np.abs(np.diff(forces[20:])).max() < 0.02
