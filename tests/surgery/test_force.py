"""A tool's force by recorded samples: the same in any replay, of tissue as it is."""

import numpy as np
import pytest

from anatomy.feel import feel_of
from anatomy.tissue import Label
from anatomy.wall_layers import WallKind
from scenarios.feeling import gape_of, tool_force
from scenarios.instruments.catalogue import INSTRUMENTS, instrument_named
from surgery import solids
from surgery.edit import CuttingLimits
from surgery.force import (
    FELT_MM,
    MOST_BALLS,
    NO_TOUCH,
    RigidPart,
    ToolForce,
    Yielding,
    balls_of,
)
from surgery.kernels import touch_force as tick
from surgery.patient import OperatedPatient
from system import UserError
from tests.surgery.heads import PAPYRACEA, SHAPE, H, floor_at, surface_of, walled

FLOOR_MM = 10.0
PLACE = np.array([12.0, 11.0, 0.0])


def patient(kind: WallKind = PAPYRACEA) -> OperatedPatient:
    surface = floor_at(FLOOR_MM)
    return OperatedPatient(surface, walled(surface, kind))


def probe(head: OperatedPatient, radius_mm: float = 1.0) -> ToolForce:
    """A straight rod whose end is its origin."""
    rod = solids.capsule([0, 0, radius_mm], [0, 0, 40], radius_mm)
    return ToolForce(head, [RigidPart(rod)])


def pose(z_mm: float, x_mm: float = 0.0) -> np.ndarray:
    frame = np.eye(4)
    frame[:3, 3] = PLACE[0] + x_mm, PLACE[1], z_mm
    return frame


def pushed(force: ToolForce, to_mm: float, seconds: float, rate_hz: float) -> float:
    """Push down from 2 mm above; gives the largest force of the tissue."""
    most = 0.0
    count = round(seconds * rate_hz)
    for n in range(count + 1):
        z = FLOOR_MM + 2 - (2 + FLOOR_MM - to_mm) * n / count
        most = max(most, force.step(n / rate_hz, pose(z)).size_n)
    return most


def test_a_push_feels_mucosa_then_bone() -> None:
    force = probe(patient())
    feel = feel_of(PAPYRACEA)
    give = tick.PRESSED * PAPYRACEA.mucosa_mm
    for n, depth in enumerate((0.3, 0.6, 1.2)):
        touch = force.step(0.1 * n, pose(FLOOR_MM - depth))
        soft = min(depth, give)
        wanted = feel.soft_n_mm * soft + feel.hard_n_mm * (depth - soft)
        assert touch.newton == pytest.approx([0, 0, wanted], rel=0.02, abs=1e-6)
        assert touch.depth_mm == pytest.approx(depth, rel=0.01)
        assert touch.wall == "lamina papyracea"
        assert touch.place_mm == pytest.approx([*PLACE[:2], FLOOR_MM], abs=0.05)


def test_nothing_is_felt_in_the_air() -> None:
    force = probe(patient())
    for n in range(20):
        touch = force.step(n / 60, pose(FLOOR_MM + 0.1, 0.2 * n))
        assert not touch.is_touching
        assert not touch.newton.any()
        assert not touch.torque_nmm.any()


def test_a_lamina_breaks_once_and_fat_behind_it_is_soft() -> None:
    force = probe(patient())
    broken: list[str] = []
    before = 0.0
    for n in range(121):
        touch = force.step(n / 60, pose(FLOOR_MM + 1 - 6 * n / 120))
        broken += touch.broken
        if touch.broken:
            before = touch.size_n
    scatter = 1.0 + tick.SCATTER
    assert PAPYRACEA.fracture_n / scatter < before < PAPYRACEA.fracture_n * scatter
    assert broken == ["lamina papyracea"]
    assert touch.size_n < 0.4
    assert touch.is_touching


def test_where_a_wall_breaks_does_not_hang_on_the_rate_of_samples() -> None:
    greatest = [pushed(probe(patient()), 4.0, 2.0, hz) for hz in (30, 60, 100, 500)]
    assert greatest == pytest.approx([greatest[-1]] * 4, rel=0.06)


def test_a_thing_that_was_cut_away_is_felt_no_more() -> None:
    head = patient()
    force = probe(head)
    assert force.step(0.0, pose(FLOOR_MM - 0.5)).is_touching
    middle = np.array([*PLACE[:2], FLOOR_MM])
    assert head.carve(solids.capsule(middle, middle, 3.0), CuttingLimits(20.0, 1.0))
    assert not force.step(0.05, pose(FLOOR_MM - 0.5)).newton.any()
    # fat lies under the lamina now
    deep = force.step(0.1, pose(FLOOR_MM - 3.4))
    assert 0.0 < deep.size_n < 0.2


def test_frozen_and_restored_it_goes_on_to_the_bit() -> None:
    force, rng = probe(patient()), np.random.default_rng(4)
    ways = FLOOR_MM - 1.0 + np.cumsum(rng.normal(0, 0.15, 200))

    def go(some: ToolForce, begin: int) -> list[np.ndarray]:
        return [
            some.step(n / 60, pose(ways[n], 0.01 * n)).newton for n in range(begin, 200)
        ]

    for n in range(100):
        force.step(n / 60, pose(ways[n], 0.01 * n))
    state = force.checkpoint()
    first = go(force, 100)
    force.restore(state)
    assert np.array_equal(first, go(force, 100))
    other = probe(patient())
    other.restore(state)
    assert np.array_equal(first, go(other, 100))


def test_a_sample_that_is_none_or_long_after_begins_anew() -> None:
    force = probe(patient())
    assert force.step(0.0, pose(FLOOR_MM - 0.5)).is_touching
    bad = pose(FLOOR_MM)
    bad[0, 3] = np.nan
    touch = force.step(0.02, bad)
    assert not touch.newton.any()
    assert touch.flags & tick.FAULT
    assert force.step(0.04, pose(FLOOR_MM - 0.5)).is_touching
    # it was away, and comes back deep in tissue
    touch = force.step(5.0, pose(FLOOR_MM - 5))
    assert touch.flags & tick.BURIED
    assert not touch.newton.any()
    assert force.step(5.0, pose(FLOOR_MM - 5)) is touch


def test_every_tool_is_covered_by_balls_that_turn_with_its_jaw() -> None:
    head = patient()
    for tool in INSTRUMENTS.values():
        force = tool_force(head, tool)
        for jaw in (1.0, 0.4, 0.0):
            force.step(1.0 - jaw, pose(FLOOR_MM + 12), jaw)
            balls = force._balls
            assert len(balls) <= MOST_BALLS
            capsules = tool.capsules(np.eye(4), jaw)
            near = capsules.start_mm[:, 2] < FELT_MM
            for place, radius in zip(
                capsules.start_mm[near], capsules.radius_mm[near], strict=True
            ):
                off = np.linalg.norm(balls[:, :3] - place, axis=1)
                at = int(np.argmin(off))
                assert off[at] < 1e-6
                assert radius in balls[off < 1e-6, 3]


def test_jaws_feel_what_is_between_them() -> None:
    head = patient()
    tool = instrument_named("straight forceps")
    frame = pose(FLOOR_MM - 3.0)
    # the jaws reach into the floor from above
    turned = frame.copy()
    force = tool_force(head, tool)
    free = force.step(0.0, pose(FLOOR_MM + 8), jaw=0.9)
    assert (free.jaw_n, free.held_mm) == (0.0, 0.0)
    told = [force.step(1 + n / 60, turned, jaw=n / 20) for n in range(1, 21)]
    forces = [touch.jaw_n for touch in told]
    assert forces == sorted(forces)
    assert forces[-1] > 0.3
    assert all(touch.jaw_n <= PAPYRACEA.fracture_n for touch in told)
    gape = gape_of(tool)
    assert gape is not None
    assert 0.0 < told[-1].held_mm <= gape.gape_mm
    assert gape_of(instrument_named("ball probe")) is None


def test_a_tube_that_sucks_is_pulled_towards_tissue() -> None:
    force = tool_force(patient(), instrument_named("suction tube"))
    still = force.step(0.0, pose(FLOOR_MM + 0.6))
    pulled = force.step(0.1, pose(FLOOR_MM + 0.6), is_sucking=True)
    assert not still.newton.any()
    assert -0.07 < pulled.newton[2] < -0.005
    assert not force.step(0.2, pose(FLOOR_MM + 3.0), is_sucking=True).newton.any()


def test_a_soft_head_without_walls_is_felt() -> None:
    force = probe(OperatedPatient(floor_at(FLOOR_MM), None))
    touch = force.step(0.0, pose(FLOOR_MM - 0.5))
    assert touch.size_n == pytest.approx(0.15, rel=0.02)
    assert touch.wall == ""


def test_a_tool_that_is_none_is_refused() -> None:
    blade = solids.blade([[0, 0, 0], [1, 0, 0]], [[0, 1, 0], [1, 1, 0]], 0.1)
    with pytest.raises(UserError, match="capsules"):
        balls_of([blade])
    many = np.repeat(solids.capsule([0, 0, 0], [0, 0, 1], 1.0), 101, axis=0)
    with pytest.raises(UserError, match="101"):
        balls_of([many])


def test_before_any_sample_nothing_is_felt() -> None:
    force = probe(patient())
    assert force.touch is NO_TOUCH
    assert not force.touch.is_touching


def test_another_tool_finds_the_hole_open() -> None:
    head = patient()
    first = probe(head)
    pushed(first, 5.0, 2.0, 60)
    second = probe(head)
    second.inherit(first)
    assert pushed(second, 8.0, 1.0, 60) < 1.0
    assert pushed(probe(head), 8.0, 1.0, 60) > 3.0


def test_a_thin_wall_between_two_airs_gives_way_to_the_other() -> None:
    """A cell's wall: behind it is air again, and the tool is free there."""
    z = H * np.arange(40)[:, None, None]
    values = np.broadcast_to(1.0 - np.abs(z - FLOOR_MM), (40, 44, 48))
    surface = surface_of(values.astype(np.float32))
    cell = WallKind("cell", 0.6, 0.25, Label.MUCOSA, Label.ETHMOID_SEPTUM, 6.0)
    head = OperatedPatient(surface, walled(surface, cell))
    force = probe(head)
    broken: list[str] = []
    for n in range(181):
        touch = force.step(n / 60, pose(FLOOR_MM + 3 - 8 * n / 180))
        broken += touch.broken
    assert broken == ["cell"]
    assert not touch.newton.any()


def channel() -> OperatedPatient:
    """Open above 10 mm; below it a slit that is 0.1 mm too narrow on either side."""
    z, y = (np.arange(n) * H for n in SHAPE[:2])
    slit = np.abs(y - PLACE[1])[None, :] - 0.9
    tissue = np.minimum(slit, (FLOOR_MM - z)[:, None])[..., None]
    surface = surface_of(np.broadcast_to(tissue, SHAPE).astype(np.float32))
    return OperatedPatient(surface, walled(surface, PAPYRACEA))


def test_a_tool_that_walls_hold_presses_as_deep_as_it_lies() -> None:
    """A rigid proxy stays before a slit that a tool passes by denting its walls."""
    most = {}
    for held in (False, True):
        force, felt = probe(channel()), []
        for n in range(200):
            at = pose(FLOOR_MM + 2.0 - 0.05 * n)
            felt.append(force.step(n / 100.0, at, held=held).size_n)
        most[held] = max(felt)
        out = [
            force.step(2.0 + n / 100.0, pose(FLOOR_MM - 8.0 + 0.05 * n), held=held)
            for n in range(240)
        ]
        assert out[-1].size_n == 0.0
    assert most[True] < 0.6 * most[False]


def test_a_flat_wall_feels_the_same_to_a_tool_that_walls_hold() -> None:
    """Down to where it breaks at the same depth, by the same force."""
    felt = []
    for held in (False, True):
        force = probe(patient())
        felt.append(
            [
                force.step(n / 100.0, pose(FLOOR_MM + 2.0 - 0.03 * n), held=held)
                for n in range(250)
            ]
        )
    assert any(touch.broken for touch in felt[0])
    for one, two in zip(*felt, strict=True):
        assert two.size_n == pytest.approx(one.size_n, abs=0.02, rel=0.02)
        assert two.broken == one.broken
        assert two.newton == pytest.approx(one.newton, abs=0.02, rel=0.02)


@pytest.mark.parametrize("newton", [0.1, 1.0, 2.5, 6.0])
def test_a_wall_yields_to_a_force_as_deep_as_it_presses_with_it(newton: float) -> None:
    head = patient()
    mm = float(Yielding(head.layers, newton).at(np.array([[*PLACE[:2], FLOOR_MM]]))[0])
    force = probe(head)
    force.step(0.0, pose(FLOOR_MM - mm), held=True)
    assert force.touch.size_n == pytest.approx(newton, rel=0.02, abs=0.01)


def test_jaws_that_bite_push_nothing_aside() -> None:
    """Of a touch something is felt; of what they go about nothing."""
    force = probe(patient())
    for n in range(100):
        z = FLOOR_MM + 2.0 - 0.06 * n
        touch = force.step(n / 100.0, pose(z), bites=True)
        assert touch.size_n < 1.5
        assert not touch.size_n or z > FLOOR_MM - tick.SEAT_MM - 0.1
