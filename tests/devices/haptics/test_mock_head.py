"""The emulated head obeys its equation, and every fault of it is a safe one."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from devices.haptics.force_records import (
    AWAY,
    HEAD_FAULTS,
    LYING,
    NO_FAULT,
    READING,
    SILENT,
)
from devices.haptics.kernels.step_head import command_probe, read_probe
from devices.haptics.mock_head import HeadFault, HeadModel, MockHead
from system import UserError
from tests.devices.haptics.bench_heads import PERIOD_NS, START_NS, Bench, place, wall

LOOSE = HeadModel(
    mass_kg=0.1,
    coulomb_n=0.0,
    viscous_ns_m=0.5,
    hand_n_m=100.0,
    hand_ns_m=1.0,
    limit_n=50.0,
    quantum_mm=0.0,
    delay_s=0.0,
)
"""That of the published figures: a loose grip, nothing but a mass and dampers."""

RAMP_S = 0.2


def pressed(model: HeadModel, stiffness_n_m: float, goal_mm: float) -> Bench:
    """Press a head into a wall for two seconds."""
    bench = Bench(MockHead(model), wall(stiffness_n_m))
    bench.head.lead(place(0, 0, 1), 0.001)
    bench.tick(100)
    bench.head.lead(place(0, 0, goal_mm), 0.2)
    bench.tick(1900)
    return bench


def swing_mm(bench: Bench) -> float:
    """The height of what is left of all swinging, in the last half second."""
    return float(np.ptp(np.array(bench.tips)[-500:, 2]))


def test_a_probe_that_nobody_pushes_swings_as_the_equation_says() -> None:
    head = MockHead(replace(LOOSE, hand_ns_m=0.0))
    bench = Bench(head, lambda _: np.zeros(3))
    head.lead(place(0, 0, 0), 0.001)
    bench.tick()
    head.lead(place(0, 0, 10), 1e-9)
    bench.tick(400)
    decay, rate = 0.5 / 0.2, math.sqrt(100 / 0.1 - (0.5 / 0.2) ** 2)
    t = np.arange(1, 401) * 1e-3
    exact = 10 - 10 * np.exp(-decay * t) * (
        np.cos(rate * t) + decay / rate * np.sin(rate * t)
    )
    np.testing.assert_allclose(np.array(bench.tips)[1:, 2], exact, atol=0.06)


def test_friction_alone_stops_a_probe_after_its_energy_is_gone() -> None:
    head = MockHead(
        replace(LOOSE, coulomb_n=0.2, viscous_ns_m=1e-6, hand_n_m=1e-9, hand_ns_m=0.0)
    )
    bench = Bench(head, lambda _: np.zeros(3))
    head.lead(place(0, 0, 0), 0.001)
    bench.tick()
    head.state["velocity_mm_s"] = [100.0, 0.0, 0.0]
    bench.tick(300)
    # m v^2 / 2 = f s: 0.1 * 0.1^2 / 0.4 m
    assert head.state["position_mm"][0, 0] == pytest.approx(2.5, abs=0.01)
    assert not head.state["velocity_mm_s"].any()


@pytest.mark.parametrize("stiffness_n_m", [100.0, 400.0, 1000.0])
def test_a_pressed_probe_settles_where_the_springs_balance(
    stiffness_n_m: float,
) -> None:
    bench = pressed(LOOSE, stiffness_n_m, -5.0)
    assert swing_mm(bench) < 1e-3
    depth = -bench.tips[-1][2]
    assert depth == pytest.approx(500.0 / (stiffness_n_m + 100.0), abs=2e-3)
    # depth = F / K
    assert 1e-3 * stiffness_n_m * depth == pytest.approx(bench.sizes[-1], rel=1e-2)


def test_a_wall_stiffer_than_the_damping_allows_buzzes_and_delay_makes_it_worse() -> (
    None
):
    """2 b / T with b = 0.5 N s/m and T = 1 ms is 1000 N/m."""
    assert LOOSE.stiffest_n_m(1e-3) == pytest.approx(1000.0)
    quiet = swing_mm(pressed(LOOSE, 1000.0, -5.0))
    assert quiet < 5e-3
    assert swing_mm(pressed(LOOSE, 12000.0, -5.0)) > 0.1
    late = replace(LOOSE, delay_s=0.004)
    assert swing_mm(pressed(late, 1000.0, -5.0)) > 0.1
    assert late.stiffest_n_m(1e-3) == pytest.approx(1000.0 / 9.0)
    assert swing_mm(pressed(late, late.stiffest_n_m(1e-3), -5.0)) < 0.02


def test_friction_swallows_the_steps_of_the_encoder() -> None:
    """K <= 2 f / q: 0.2 N and 0.2 mm bear 2000 N/m, 0.01 N do not."""
    steps = replace(LOOSE, quantum_mm=0.2)
    assert swing_mm(pressed(replace(steps, coulomb_n=0.01), 2000.0, -5.0)) > 0.02
    assert swing_mm(pressed(replace(steps, coulomb_n=0.2), 2000.0, -5.0)) < 1e-3
    assert replace(steps, coulomb_n=0.05).stiffest_n_m(1e-3) == pytest.approx(500.0)


def test_a_walls_energy_is_not_given_back_with_more() -> None:
    """A probe thrown at a wall that its damping allows leaves no faster."""
    for share in (0.25, 0.5, 1.0):
        model = replace(LOOSE, hand_n_m=1e-9, hand_ns_m=0.0)
        bench = Bench(MockHead(model), wall(share * model.stiffest_n_m(1e-3)))
        bench.head.lead(place(0, 0, 1), 0.001)
        bench.tick()
        bench.head.state["velocity_mm_s"] = [0.0, 0.0, -100.0]
        bench.tick(400)
        heights = np.array(bench.tips)[:, 2]
        assert heights.min() < 0.0 < heights[-1]
        assert np.gradient(heights, 1e-3).max() <= 100.0


def test_the_encoder_counts_whole_steps_and_no_others() -> None:
    head = MockHead(replace(LOOSE, quantum_mm=0.05))
    bench = Bench(head, lambda _: np.zeros(3))
    head.lead(place(0, 0, 0), 0.001)
    bench.tick()
    head.lead(place(1, 2, 3), 0.1)
    for _ in range(50):
        bench.tick()
        told = bench.reading["position_mm"][0]
        assert np.allclose(told / 0.05, np.round(told / 0.05), atol=1e-9)
        assert np.abs(told - bench.tips[-1]).max() <= 0.025 + 1e-12


@settings(max_examples=25, deadline=None)
@given(st.lists(st.integers(1, 3_000_000), min_size=5, max_size=40))
def test_where_a_probe_goes_does_not_depend_on_when_it_is_read(
    steps_ns: list[int],
) -> None:
    ends = []
    for moments in (np.cumsum(steps_ns), [sum(steps_ns)]):
        head = MockHead(replace(LOOSE, coulomb_n=0.1))
        reading = np.zeros(1, READING)
        head.lead(place(0, 0, 0), 0.001)
        read_probe(head.state[0], reading[0], START_NS)
        head.lead(place(4, -3, 2), 0.02)
        # the goal is taken at the first reading: the same for both
        read_probe(head.state[0], reading[0], START_NS)
        for moment in moments:
            read_probe(head.state[0], reading[0], START_NS + int(moment))
        ends.append(head.state[0].copy())
    assert np.array_equal(ends[0]["position_mm"], ends[1]["position_mm"])
    assert np.array_equal(ends[0]["velocity_mm_s"], ends[1]["velocity_mm_s"])


def test_a_command_reaches_the_motor_after_its_delay_and_ends_with_the_commands() -> (
    None
):
    head = MockHead(replace(LOOSE, delay_s=0.003, watchdog_s=0.02))
    reading = np.zeros(1, READING)
    state = head.state[0]
    head.lead(place(0, 0, 0), 0.001)
    pushes = []
    for tick in range(60):
        read_probe(state, reading[0], START_NS + tick * PERIOD_NS)
        pushes.append(state["motor_n"][0])
        if tick == 10:
            command_probe(state, 1.5, 0.0, 0.0, START_NS + tick * PERIOD_NS)
    assert not any(pushes[:14])
    assert pushes[14:30] == [1.5] * 16
    assert not any(pushes[36:])


def test_a_motor_gives_no_more_than_it_can_and_a_saturated_one_less() -> None:
    for fault, most in (("none", 2.0), ("saturated", 0.4)):
        head = MockHead(replace(LOOSE, limit_n=2.0), HeadFault(fault))
        reading = np.zeros(1, READING)
        head.lead(place(0, 0, 0), 0.001)
        for tick in range(5):
            command_probe(head.state[0], 30.0, 40.0, 0.0, START_NS + tick * PERIOD_NS)
            read_probe(head.state[0], reading[0], START_NS + tick * PERIOD_NS)
        push = head.state["motor_n"][0]
        assert np.linalg.norm(push) == pytest.approx(most)
        assert push[0] * 4 == pytest.approx(push[1] * 3)


def test_the_probe_turns_with_the_hand_and_stays_a_rotation() -> None:
    head = MockHead()
    bench = Bench(head, lambda _: np.zeros(3))
    head.lead(place(0, 0, 0), 0.001)
    bench.tick()
    turned = place(0, 0, 0)
    c, s = math.cos(0.6), math.sin(0.6)
    turned[:3, :3] = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
    head.lead(turned, 0.02)
    bench.tick()
    angles = []
    for _ in range(25):
        bench.tick()
        matrix = bench.reading["rotation"][0]
        np.testing.assert_allclose(matrix @ matrix.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(matrix) > 0.9
        angles.append(math.atan2(matrix[0, 2], matrix[2, 2]))
    assert (np.diff(angles) >= 0.0).all()
    assert max(np.diff(angles)) < 0.05
    np.testing.assert_array_equal(bench.reading["rotation"][0], turned[:3, :3])


def faulty(words: str) -> Bench:
    """Press a head into a wall, harder than it may push; its fault comes at 0.5 s."""
    bench = Bench(MockHead(fault=HeadFault.parse(words)), wall(5000.0), RAMP_S)
    bench.head.lead(place(0, 0, 1), 0.001)
    bench.tick(100)
    bench.head.lead(place(0, 0, -14), 0.2)
    bench.tick(1100)
    return bench


@pytest.mark.parametrize("name", HEAD_FAULTS[1:])
def test_no_fault_makes_a_force_beyond_the_limit(name: str) -> None:
    bench = faulty(f"{name}@0.5+0.2")
    limit = bench.head.limits.force_n
    assert bench.sizes.max() == pytest.approx(limit, rel=1e-9)
    assert bench.sizes.max() <= limit
    assert bench.head.state["largest_n"][0] <= limit
    assert np.isfinite(bench.sizes).all()


@pytest.mark.parametrize(
    ("name", "fault"), [("silent", SILENT), ("unplugged", AWAY), ("lying", LYING)]
)
def test_poses_that_stop_or_lie_end_the_force_and_it_comes_back_slowly(
    name: str, fault: int
) -> None:
    bench = faulty(f"{name}@0.5+0.2")
    sizes, faults = bench.sizes, np.array(bench.faults)
    assert sizes[499] > 1.0
    stopped = np.flatnonzero(faults == fault)
    begins, ends = stopped[0], stopped[-1]
    if name != "lying":
        # the last pose came at tick 499: nothing two ticks, 2 ms, later
        assert 500 <= begins <= 501
        assert not sizes[501:701].any()
    assert not sizes[faults != NO_FAULT].any()
    share = (np.arange(len(sizes)) - ends - 1) / (RAMP_S * 1e3)
    back = sizes[ends + 1 :]
    assert (back <= bench.head.limits.force_n * np.minimum(share[ends + 1 :], 1)).all()
    assert back[-1] > 1.0


def test_a_liar_is_never_pushed_by_its_lie() -> None:
    """Every pose that jumps, or is none, has no force; the next true one neither."""
    bench = faulty("lying@0.5+0.2")
    lies = np.flatnonzero(np.array(bench.faults) == LYING)
    assert len(lies) >= 25
    assert lies.min() >= 500
    assert lies.max() <= 702


def test_a_stuck_encoder_pushes_as_before_and_no_more() -> None:
    bench = faulty("stuck@0.5+0.2")
    np.testing.assert_array_equal(bench.sizes[501:700], bench.sizes[500])


def test_words_that_name_no_fault_are_refused_with_those_that_do() -> None:
    assert HeadFault.parse("silent@10+2") == HeadFault("silent", 10.0, 2.0)
    assert HeadFault.parse("lying@3.5") == HeadFault("lying", 3.5, None)
    assert HeadFault.parse("unplugged") == HeadFault("unplugged", 0.0, 1.0)
    for words in ("", "none", "loud", "silent@", "silent@-1", "silent@1+", "silent@x"):
        with pytest.raises(UserError, match="stuck, saturated, silent, lying"):
            HeadFault.parse(words)


def test_a_head_that_cannot_move_is_refused() -> None:
    with pytest.raises(UserError, match="mass"):
        HeadModel(mass_kg=0.0)
    with pytest.raises(UserError, match="under way"):
        HeadModel(delay_s=1.0)
