import itertools
import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from devices.microscribe.emulator.motion import (
    ORBIT_CENTRE_MM,
    ORBIT_PERIOD_S,
    ORBIT_RADIUS_MM,
    AngleRegisters,
    AnglesMotion,
    StillMotion,
    follow_tip,
    orbit,
)
from devices.microscribe.kinematics.profiles import (
    DX40937,
    HOME_COUNTS,
    ODD_MAXIMA,
    SIX_JOINTS,
    ArmProfile,
)

# Rounding to whole counts moves the tip by no more (measured).
WORST_ROUNDING_MM = 0.31


def tip(counts: tuple[int, ...]) -> NDArray[np.float64]:
    angles = DX40937.encoders.angles(np.array(counts))
    return DX40937.geometry.device_from_tip(angles)


def test_an_arm_that_stands() -> None:
    motion = StillMotion(DX40937, (1, 2, 3, 4, 5, 6))
    motion.begin(0.0)
    motion.buttons = 2
    assert motion.latch(9.0) == ((1, 2, 3, 4, 5, 6), 2)
    motion.home()
    assert motion.latch(9.0)[0] == HOME_COUNTS


def test_an_arm_that_stands_on_the_index_mark_of_its_roll_encoder_says_so() -> None:
    """Home counts are 0 there, and the mark is at every whole turn."""
    motion = StillMotion(SIX_JOINTS)
    assert motion.latch(0.0)[1] == 4
    motion.buttons = 1
    assert motion.latch(0.0)[1] == 5
    for count, buttons in ((1, 1), (2000, 5), (1999, 1), (14000, 5)):
        motion.counts = (*HOME_COUNTS[:5], count)
        assert motion.latch(0.0)[1] == buttons


def test_joints_follow_a_function_from_the_first_packet_on() -> None:
    motion = AnglesMotion(DX40937, lambda t: [0.5 + t, 0.0, 0.0, 0.0, 0.0])
    scale = 16384 / (2.0 * math.pi)
    assert motion.latch(5.0)[0][0] == round(0.5 * scale)
    motion.begin(10.0)
    motion.begin(11.0)
    for now in (10.0, 10.7, 13.0):
        assert motion.latch(now)[0][0] == round((0.5 + now - 10.0) * scale)
        assert motion.latch(now)[0][5] == HOME_COUNTS[5]
    motion.home()
    assert motion.latch(13.0)[0] == HOME_COUNTS


@pytest.mark.parametrize("angles", [[0.0] * 4, [0.0] * 7, [math.nan] * 5])
def test_other_numbers_of_angles_are_refused(angles: list[float]) -> None:
    with pytest.raises(ValueError, match="five or six finite angles"):
        AnglesMotion(DX40937, lambda t: angles)


def test_a_sixth_angle_is_the_roll() -> None:
    motion = AnglesMotion(SIX_JOINTS, lambda t: [0.0] * 5 + [math.pi / 2])
    assert motion.latch(0.0)[0][5] == 500


def test_the_tip_follows_a_function() -> None:
    down = np.array((0.0, 0.0, -1.0))
    motion = follow_tip(DX40937, lambda t: (np.array((250.0, 40.0 * t, 100.0)), down))
    motion.begin(0.0)
    for t in np.linspace(-1.0, 1.0, 9):
        pose = tip(motion.latch(float(t))[0])
        assert (
            np.linalg.norm(pose[:3, 3] - (250.0, 40.0 * t, 100.0)) < WORST_ROUNDING_MM
        )
        assert -pose[2, 2] == pytest.approx(-1.0, abs=1e-5)


def test_the_orbit_is_round_closed_and_calm() -> None:
    motion = orbit(DX40937)
    motion.begin(0.0)
    times = np.arange(0.0, 2.0 * ORBIT_PERIOD_S, 0.05)
    counts = [motion.latch(float(t))[0] for t in times]
    tips = np.array([tip(c)[:3, 3] for c in counts]) - ORBIT_CENTRE_MM
    radius = np.hypot(tips[:, 0], tips[:, 1])
    assert np.abs(radius - ORBIT_RADIUS_MM).max() < WORST_ROUNDING_MM
    steps = np.array([np.subtract(b, a) for a, b in itertools.pairwise(counts)])
    steps = (steps + 8192) % 16384 - 8192
    degrees = np.abs(steps[:, :5]) / DX40937.encoders.turn[:5] * 360.0
    assert degrees.max() / 0.05 < 240.0
    ends = np.array(motion.latch(2.0 * ORBIT_PERIOD_S)[0]) - counts[0]
    assert np.abs((ends + 8192) % 16384 - 8192).max() <= 1


angles = st.lists(st.floats(-30.0, 30.0), min_size=6, max_size=6)
profiles = st.sampled_from((DX40937, SIX_JOINTS, ODD_MAXIMA))


@pytest.mark.parametrize("profile", [DX40937, SIX_JOINTS, ODD_MAXIMA])
def test_at_rest_it_reads_the_home_counts(profile: ArmProfile) -> None:
    registers = AngleRegisters(profile)
    counts, _ = registers.read(registers.home_angles)
    assert counts == profile.home_counts


@given(profiles, angles, angles)
def test_homing_anywhere_loads_the_home_counts_and_keeps_differences(
    profile: ArmProfile, there: list[float], then: list[float]
) -> None:
    registers = AngleRegisters(profile)
    before = registers.read(then)[0]
    at_home = registers.read(there)[0]
    registers.home(there)
    assert registers.read(there)[0] == profile.home_counts
    after = registers.read(then)[0]
    for i, turn in enumerate(profile.encoders.turn):
        if turn > 1:
            shift = (profile.home_counts[i] - at_home[i]) % 16384
            assert (after[i] - before[i]) % 16384 == shift


@given(profiles, angles)
def test_counts_are_within_half_a_count_of_the_angle(
    profile: ArmProfile, there: list[float]
) -> None:
    counts, _ = AngleRegisters(profile).read(there)
    for count, angle, turn, home in zip(
        counts, there, profile.encoders.turn, profile.home_counts, strict=True
    ):
        if turn == 1:
            assert count == home
            continue
        exact = Fraction(angle / (2.0 * math.pi)) * turn
        off = (Fraction(count) - exact + 8192) % 16384 - 8192
        assert abs(off) <= Fraction(1, 2) + Fraction(1, 10**9)


def test_the_roll_index_shows_once_a_turn_whatever_the_field_wraps() -> None:
    registers = AngleRegisters(SIX_JOINTS)
    turn = 2.0 * math.pi / 2000.0
    marks = [
        count
        for count in range(0, 40_000, 250)
        if registers.read([0.0] * 5 + [count * turn])[1]
    ]
    assert marks == list(range(0, 40_000, 2000))
    assert AngleRegisters(DX40937).read([0.0] * 6)[1] == 0
