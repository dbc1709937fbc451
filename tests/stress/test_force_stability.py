"""Hands and devices in simulated time against the compiled tick of force.

A mass of 0.1 kg with 0.5 N s/m of its own, held by a hand of 100 N/m and 1 N s/m, moves
in steps of 0.1 ms; the loop reads its place every millisecond, and holds its force
until the next. No clock is asked.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest

from surgery.kernels import touch_force as tick
from tests.surgery.one_wall import H, Tick, ball, floor, groove, sheet

MASS_KG, OWN_NS_M = 0.1, 0.5
HAND_N_M, HAND_NS_M = 100.0, 1.0
TOUCHING_MM = 1.0
"""Height of the ball's middle where it touches the floor."""

FINE_S, T = 1e-4, 1e-3

Stall = Callable[[int], float]


@dataclass
class Device:
    """A mass on a vertical rail over a wall.

    quantum_mm: of the place that the loop reads. delay: ticks until a force arrives.
    hand: whether one holds it at `aim_mm`. coulomb_n: dry friction.
    """

    wall: Tick
    place_mm: float = 3.0
    speed_mm_s: float = 0.0
    aim_mm: float = 0.5
    hand: bool = True
    delay: int = 0
    quantum_mm: float = 0.0
    coulomb_n: float = 0.0
    places: list[float] = field(default_factory=list)
    forces: list[float] = field(default_factory=list)

    def run(self, seconds: float, period: Stall = lambda n: T) -> np.ndarray:
        """Step the loop; period: of each tick, s. Gives the places at its ticks."""
        time, n = 0.0, 0
        waiting = [0.0] * self.delay
        while time < seconds:
            dt = period(n)
            seen = self.place_mm
            if self.quantum_mm:
                seen = round(seen / self.quantum_mm) * self.quantum_mm
            waiting.append(float(self.wall.at([0, 0, seen], dt=dt if n else T)[2]))
            self.forces.append(waiting.pop(0))
            self.places.append(self.place_mm)
            for _ in range(round(dt / FINE_S)):
                self.move(self.forces[-1])
            time += dt
            n += 1
        return np.array(self.places)

    def move(self, force_n: float) -> None:
        """Move on by `FINE_S`; friction never turns the mass round."""
        speed = self.speed_mm_s * 1e-3
        force = force_n - OWN_NS_M * speed
        if self.hand:
            force += HAND_N_M * (self.aim_mm - self.place_mm) * 1e-3
            force -= HAND_NS_M * speed
        after = speed + force / MASS_KG * FINE_S
        slowed = self.coulomb_n / MASS_KG * FINE_S
        after = np.sign(after) * max(abs(after) - slowed, 0.0)
        self.speed_mm_s = after * 1e3
        self.place_mm += self.speed_mm_s * FINE_S


def swing(places: np.ndarray, last: int = 300) -> float:
    """Give what is left of an oscillation, peak to peak, mm."""
    return float(np.ptp(places[-last:]))


def wall_of(stiffness_n_mm: float, **more: Any) -> Tick:
    return Tick(floor(), soft=stiffness_n_mm, hard=stiffness_n_mm, **more)


@pytest.mark.parametrize("friction", [0.0, 0.2])
def test_a_sampled_wall_settles_up_to_the_bound(friction: float) -> None:
    """K = 2 b / T is 1 N/mm."""
    for share in (0.25, 0.5, 1.0):
        device = Device(wall_of(share * 2 * OWN_NS_M * 1e-3 / T, friction=friction))
        assert swing(device.run(3.0)) < 0.002


def test_far_above_the_bound_it_swings_and_so_the_test_can_fail() -> None:
    assert swing(Device(wall_of(4.0)).run(3.0)) > 0.02


@pytest.mark.parametrize("delay", [0, 1, 2, 4, 7, 10])
def test_with_delay_half_of_the_bound_is_still(delay: int) -> None:
    """K = b / 2 (T/2 + delay): what a device may be told that is so late."""
    stiffest = 0.5 * OWN_NS_M * 1e-3 / (T / 2 + delay * T)
    device = Device(
        wall_of(20.0, stiffest=stiffest, damping=OWN_NS_M * 1e-3, viscous=5e-4),
        delay=delay,
    )
    assert swing(device.run(6.0)) < 0.01


def test_a_stall_is_survived() -> None:
    """5 ms now and then, bursts, and uniform jitter, at the bound without one."""
    rng = np.random.default_rng(2)
    patterns: list[Stall] = [
        lambda n: 5 * T if n % 400 == 200 else T,
        lambda n: 5 * T if n % 400 in (200, 202, 204) else T,
        lambda n: round(rng.uniform(0.8, 1.2), 1) * T,
    ]
    for pattern in patterns:
        device = Device(wall_of(2 * OWN_NS_M * 1e-3 / T / 2))
        device.run(3.0, pattern)
        # what a stall lets sink in comes back and never grows
        assert np.ptp(device.places[-900:]) < 0.25
        assert max(device.forces) < 1.0
        assert device.places[-1] > 0.5


def test_stalls_give_a_free_mass_no_energy() -> None:
    """Thrown at the wall, with stalls at any moment, it comes back no faster."""
    for begin in range(20):
        device = Device(wall_of(0.5), place_mm=2.0, speed_mm_s=-100.0, hand=False)

        def stall(n: int, begin: int = begin) -> float:
            return 5 * T if n == begin else T

        device.run(0.12, stall)
        assert device.place_mm > TOUCHING_MM
        assert device.speed_mm_s <= 100.0


@pytest.mark.parametrize("share", [0.25, 1.0])
def test_a_mass_bounces_no_higher(share: float) -> None:
    stiffness = share * 2 * OWN_NS_M * 1e-3 / T
    for speed in (20.0, 50.0, 100.0):
        device = Device(wall_of(stiffness), place_mm=1.5, speed_mm_s=-speed, hand=False)
        device.run(0.15)
        assert device.place_mm > TOUCHING_MM
        assert 0.0 < device.speed_mm_s <= speed


@pytest.mark.parametrize(
    ("quantum_mm", "coulomb_n"), [(0.02, 0.05), (0.05, 0.05), (0.05, 0.1), (0.2, 0.2)]
)
def test_friction_stills_what_quanta_excite(
    quantum_mm: float, coulomb_n: float
) -> None:
    """K <= 2 f / q (Abbott and Okamura 2005), and no more than the bound."""
    stiffness = min(2.0 * coulomb_n / quantum_mm, 0.5)
    device = Device(
        wall_of(stiffness), quantum_mm=quantum_mm, coulomb_n=coulomb_n, aim_mm=0.31
    )
    assert swing(device.run(3.0)) < 0.1 * quantum_mm


@pytest.mark.parametrize(("friction", "most"), [(0.0, 0.02), (0.1, 1e-3)])
def test_a_thousand_strokes_give_back_no_energy(friction: float, most: float) -> None:
    """Random strokes into a ball, mucosa over bone.

    Without friction an interpolated field returns up to a fiftieth more than one stroke
    put in, and nothing on the whole; friction takes from each.
    """
    tool = Tick(
        ball(), mucosa_mm=1.0, bone_mm=2.0, soft=0.3, hard=1.0, friction=friction
    )
    rng = np.random.default_rng(6)
    gained = put_in = 0.0
    for _ in range(1000):
        tool.state[:] = 0.0
        way = rng.normal(size=3)
        way[2] = abs(way[2]) + 0.5
        way /= np.linalg.norm(way)
        begin, deep = 7.2 * way, (7.0 - rng.uniform(0.3, 1.0)) * way
        deep = deep + rng.uniform(-0.5, 0.5, 3)
        path = np.concatenate(
            [np.linspace(begin, deep, 60), np.linspace(deep, 7.6 * way, 60)]
        )
        forces = tool.along(path)
        # work of the tissue on the hand, by the trapezoidal rule
        work = (0.5 * (forces[1:] + forces[:-1]) * np.diff(path, axis=0)).sum(axis=1)
        put = float(-np.minimum(work, 0.0).sum())
        # a hundred-thousandth of a N mm is the rule's own error in a graze
        assert work.sum() <= most * put + 1e-5
        gained += float(work.sum())
        put_in += put
    assert gained <= 1e-3 * put_in


def test_a_thin_wall_pops_once_and_stays_still_after() -> None:
    """A hand pushes 5 mm/s through a wall of a voxel; it does not swing."""
    wall = Tick(sheet(), bone_mm=H, soft=0.5, hard=0.5, break_n=0.6)
    device = Device(wall, place_mm=2.5, aim_mm=2.5)
    for _ in range(300):
        device.aim_mm -= 0.05
        device.run(0.01)
    assert wall.state[tick.BROKEN] == 1
    broke = int(np.flatnonzero(np.array(device.forces) > 0)[-1])
    assert 0.6 * 0.7 < max(device.forces) < 0.6 * 1.35
    assert device.place_mm < -6.0
    # on the way to the break the force only grows, but for the first touch: a mass
    # of 0.1 kg at 5 mm/s bounces by v sqrt(K m) = 0.035 N
    forces = np.array(device.forces[: broke + 1])
    assert np.all(np.maximum.accumulate(forces) - forces < 0.05)


def test_between_two_touching_walls_it_settles() -> None:
    tool = Tick(
        groove(45.0), np.array([[-2.0, 0, 0, 1], [2.0, 0, 0, 1]]), soft=0.7, hard=0.7
    )
    rest = (1.0 + 2.0 * np.cos(np.pi / 4)) / np.sin(np.pi / 4)
    device = Device(tool, place_mm=rest + 1.0, aim_mm=rest - 1.0)
    assert swing(device.run(3.0)) < 0.002
    assert tool.out[tick.PASSES] <= tick.MOST_PASSES
