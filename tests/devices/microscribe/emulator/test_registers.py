import math
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.microscribe.emulator.registers import AngleRegisters
from devices.microscribe.kinematics.profiles import (
    DX40937,
    ODD_MAXIMA,
    SIX_JOINTS,
    ArmProfile,
)

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
